#pragma once

#include "modules/diagnosis/finding.hpp"
#include "modules/sensors/usual_numbers.hpp"

namespace km {

/// The finding of the doctor and of a run: an error if the cause is known.
[[nodiscard]] inline Finding finding_of(const Doubt& doubt) {
  return {.id = doubt.id,
          .severity = doubt.is_explained ? Severity::kError : Severity::kWarning,
          .what = doubt.what,
          .means = doubt.means,
          .to_do = doubt.to_do};
}

}  // namespace km
