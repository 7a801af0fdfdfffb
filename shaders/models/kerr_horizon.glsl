// Provides where a rotating hole swallows light: at the horizon.

bool absorbed(RayState s) {
    return kerr_schild(s.x).r <= ABSORBING * horizon();
}
