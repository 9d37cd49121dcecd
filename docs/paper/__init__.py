"""docs/paper.md: the paper's figures 6 to 16 beside ours. `python -m docs.paper` makes every one of them again."""
