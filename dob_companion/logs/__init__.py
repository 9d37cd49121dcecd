"""What other programs wrote down of a flight, each kind of file read into one `identification.record.Record`."""
