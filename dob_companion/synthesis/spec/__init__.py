"""What is asked: the spec file and the arguments of a call, read and checked before anything is computed."""
