#pragma once

#include <cstdint>
#include <string>

#include "modules/core/config.hpp"

namespace km {

/// Solver of a session. The values are those in messages.
enum class PgoMethod : std::uint8_t {
  kRbcd = 0,    ///< Riemannian block-coordinate descent, see MemberRbcd.
  kNewton = 1,  ///< Newton's method, robust, see TreeNewton.
};

/// All methods with their names in configuration files. solver_choice() creates the solver of each.
inline constexpr Choice<PgoMethod> kPgoMethods[] = {{"newton", PgoMethod::kNewton},
                                                    {"rbcd", PgoMethod::kRbcd}};

/// The name in configuration files; empty for a value that is none of the methods.
[[nodiscard]] inline std::string to_string(PgoMethod method) {
  return Choices<PgoMethod>{kPgoMethods}.name_of(method);
}

}  // namespace km
