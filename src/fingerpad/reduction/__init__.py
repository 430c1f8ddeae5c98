"""A touch in real time: the responses of full presses, interpolated over poses and relaxed in time."""
