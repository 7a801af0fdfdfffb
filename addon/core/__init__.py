"""Nonlinear ray tracing without Blender: numpy in, numpy out."""
