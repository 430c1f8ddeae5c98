"""The paper by level: what is pressed and read from it, its claims, and `reproduction`, which runs all."""
