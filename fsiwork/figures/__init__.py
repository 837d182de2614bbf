"""Dataset in, figure out; the only place with matplotlib."""
