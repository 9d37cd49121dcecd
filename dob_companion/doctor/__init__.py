"""What a look at the link finds: what is heard, how well, and what of it stands in the way of flying."""
