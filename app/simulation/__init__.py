"""Simulated participants: who they are (people), how they answer over HTTP (client), where they are
let in (views).
"""
