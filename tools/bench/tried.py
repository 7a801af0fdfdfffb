"""What was done for figures that are not reached; the benchmark prints it with them. Measured on llvmpipe."""

LOOP = """\
perf shows why on llvmpipe: a step waits for itself, as each stage's root, quotient and products follow one
another, and Nystrom's stages, which have half the operations, take as long. Shortened: sums whose last term is
one product away (17 % less time a step), r^5 by one root and one quotient, rough logarithms for the step size
(25 %). No gain: vectors of 512 bits, an inverse root by Newton's method."""

STEPS = """\
Step sizes predicted from how the error changes along the ray (half the steps at the same error), Nystrom's
method, longer largest steps in the potential and the explosion, a method of third order where errors may be
large. What is left is the objects: see Figure 5."""

WALKS = """\
A ray has some five pieces near the torus, one a step, each of which meets about five nodes of the tree; a
straight ray has one, of 6.8 nodes. Reading texels takes most of a node's time: two instead of four took 17 %
off a frame. Pieces are the cubics that they are, against boxes made thick, instead of chords within the
tolerance: 35 % less at the default tolerance. No gain: pieces of several steps, leaves of 2 to 8 triangles,
chords walked together. Not tried: nodes with four children."""
