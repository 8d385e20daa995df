#pragma once

#include <cstdint>

namespace km {

/// How the members of a session come to its solution. The values are those on the wire.
enum class PgoMethod : std::uint8_t {
  kRbcd = 0,    ///< Riemannian block-coordinate descent, see MemberRbcd.
  kNewton = 1,  ///< Newton's method, robust, see TreeNewton.
};

/// As in configuration files.
[[nodiscard]] constexpr const char* to_string(PgoMethod method) {
  return method == PgoMethod::kNewton ? "newton" : "rbcd";
}

}  // namespace km
