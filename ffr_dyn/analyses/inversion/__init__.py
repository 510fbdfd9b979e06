"""Motions that are known while forces elsewhere realise them."""
