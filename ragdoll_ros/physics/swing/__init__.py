"""Swings: hair, tails and straps as pendulum chains on bones, without reaction on them."""
