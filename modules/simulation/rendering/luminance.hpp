#pragma once

#include <Eigen/Core>

namespace km {

/// What a grey camera sees of linear colour: the weights of ITU-R BT.709.
inline float luminance_of(const Eigen::Vector3f& rgb) {
  return 0.2126F * rgb.x() + 0.7152F * rgb.y() + 0.0722F * rgb.z();
}

}  // namespace km
