"""A flight as a pure reducer: observations, requests and answers in; events and commands out."""
