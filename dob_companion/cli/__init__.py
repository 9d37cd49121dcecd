"""The command line: parse, call, print, exit code. Each command imports its wing only when it runs."""
