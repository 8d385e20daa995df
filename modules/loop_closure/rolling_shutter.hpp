#pragma once

#include "modules/core/camera.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/keyframe.hpp"

namespace km {

/// Moves the keypoints of a rolling shutter to where they are at the stamp of the image, the
/// exposure of its middle row. `camera`: the left camera; `readout_s`: time from the first to the
/// last row; `twist_body`: [rotation; translation] of the body in its frame [rad/s; m/s].
///
/// The camera has the angular rate w and the velocity v. A point that stands still has the bearing
/// b on z = 1 and the inverse depth rho. They change by db/dt = u - u_z b and drho/dt = -u_z rho,
/// with u = -w x b - rho v. See Longuet-Higgins and Prazdny, "The Interpretation of a Moving
/// Retinal Image", Proc. R. Soc. B 1980. A keypoint without depth counts as infinitely far.
void unroll(const Camera& camera, double readout_s, const Vector6& twist_body,
            KeyframeFeatures& features);

}  // namespace km
