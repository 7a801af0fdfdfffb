// Provides how a ray ends. The numbers are those of addon/core/status.py; a test compares them.

const float NO_HIT = 1.0e29;  // a depth above it: nothing was hit (FAR in addon/core/pipelines/paper.py)
const float RUNNING = 0.0;
const float HIT = 1.0;
const float ESCAPED = 2.0;
const float ABSORBED = 3.0;
const float LEFT_DOMAIN = 4.0;
const float STEP_LIMIT = 5.0;
const float STEP_TOO_SMALL = 6.0;
const float NOT_FINITE = 7.0;
const float LOST = 8.0;
