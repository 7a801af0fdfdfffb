"""What is not smooth in a law or swallows rays, and the shader files that end steps there."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Borders:
    """files : of shaders/borders. With "located" among them, the law defines border(), which is positive in the region
    that a ray is in and 0 on its border, and border_heart(), what the border lies around; where a ray may cross it,
    also hold(), which chooses the formula of a region.
    advance : the file of shaders/advances, for constant steps in the paper's pipeline
    """

    files: tuple[str, ...]
    advance: str


NO_BORDERS = Borders(("borders/none", "borders/all_errors"), "advances/plain")
SWALLOWING = Borders(("borders/located", "borders/swallowing", "borders/all_errors"), "advances/swallowed")
LEAVING = Borders(("common/bounds", "borders/located", "borders/leaving", "borders/all_errors"), "advances/plain")
# The law is continuous on a rim and in a front: constant steps, which know no errors, go through as through all else.
RIM = Borders(("borders/located", "borders/rim", "borders/all_errors"), "advances/held")
FRONT = Borders(("borders/located", "borders/refracting", "borders/front_errors"), "advances/held")
JUMP = Borders(("common/bounds", "borders/located", "borders/refracting", "borders/all_errors"), "advances/crossing")
