"""What `make bench` measures: speed against other packages, against this machine's memory, and against targets."""
