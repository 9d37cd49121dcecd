"""What an observer is designed for: discrete models, weights, the loop as it flies, and whether there is an answer."""
