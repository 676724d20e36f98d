"""A folder of recordings: who was recorded, how, which file is whose, and what is wrong with any of them."""
