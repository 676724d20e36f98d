"""The exam by strangers: is the truth within the interval where the heart is not the model?"""
