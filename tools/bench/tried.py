"""What was done for figures that are not reached; the benchmark prints it with them. Measured on llvmpipe."""

LOOP = """\
perf shows why on llvmpipe: a step waits for itself, as each stage's root, quotient and products follow one
another, and for the last step's error estimate; Nystrom's stages, which have half the operations, take as long.
Shortened: sums whose last term is one product away (17 % less time a step), r^5 by one root and one quotient,
rough logarithms for the step size (25 %), uniforms that are read once instead of wherever they stand (8 to
16 %). No gain: vectors of 512 bits, an inverse root by Newton's method."""

STEPS = """\
Step sizes predicted from how the error changes along the ray (half the steps at the same error), Nystrom's
method, longer largest steps in the potential and the explosion, one step through the space around the explosion
(19 %), a method of third order where errors may be large; tiles that begin as large as the last frame's time
allows (half the time of a small frame); empty space without the tree (see the torus); the explosion's
noise once less a step (11 to 16 %). No gain: its largest steps up to three times as long."""

WALKS = """\
Pieces of a ray that are far from all objects pass through empty space (a grid of distances) without the tree: of
five pieces a ray near the torus 0.6 are left for it, and a frame takes a third less. Of what it takes now a third
each is steps, looks at the empty space, and the tree; llvmpipe runs every loop once, also where no ray needs it.
One sphere a leaf instead of four: 6 to 12 %.
Pieces are the cubics that they are, against boxes made thick, instead of chords within the tolerance: 35 % less
at the default tolerance. Nodes of two texels instead of four: 17 %. Uniforms read once: 8 to 16 %. No gain: pieces
of several steps, leaves of 1 to 8 triangles, fewer rounds of Newton's method, one root of two where it is enough;
and nodes with four children would take as many instructions, counted, as two of theirs with two."""
