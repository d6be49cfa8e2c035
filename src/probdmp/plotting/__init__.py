"""Values to pictures: every function takes matplotlib axes and returns them. Needs the extra `plot`."""
