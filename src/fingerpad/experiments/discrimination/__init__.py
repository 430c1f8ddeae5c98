"""Discrimination tasks: which stimuli can an observer of a population discriminate?"""
