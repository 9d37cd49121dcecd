"""The best observer there is for stated limits, by convex programmes, at an order that flies."""
