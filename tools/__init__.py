"""Programs of the development that are not installed."""
