"""The validation by hearts of other generators: is the truth within where the heart is not the model?"""
