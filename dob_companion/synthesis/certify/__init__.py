"""What an observer of given matrices is worth: certificate, margins, responses; observers of lower order."""
