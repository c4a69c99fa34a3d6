"""A flight as one pure reducer: what is seen, asked and answered goes in, what is recorded and sent comes out."""
