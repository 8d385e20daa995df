#pragma once

#include <cstdint>

namespace km {

/// How the members of a session come to its solution. The values are those on the wire.
enum class PgoMethod : std::uint8_t {
  kRbcd = 0,    ///< Riemannian block-coordinate descent: robots update their blocks in turn.
  kNewton = 1,  ///< Newton's method on the whole team's graph, see NewtonAgent.
  kGnc = 2,     ///< Graduated non-convexity, which rejects closures as it goes, see GncAgent.
};

/// As in configuration files.
[[nodiscard]] constexpr const char* to_string(PgoMethod method) {
  switch (method) {
    case PgoMethod::kNewton:
      return "newton";
    case PgoMethod::kGnc:
      return "gnc";
    case PgoMethod::kRbcd:
      break;
  }
  return "rbcd";
}

}  // namespace km
