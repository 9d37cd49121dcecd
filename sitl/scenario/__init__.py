"""What is flown: scenario files, their script, events and checks. Pure but for reading files."""
