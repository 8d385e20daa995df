#pragma once

#include <span>
#include <string>
#include <vector>

#include "modules/core/json.hpp"

namespace km {

/// Consequence of a finding for a run.
enum class Severity {
  kNote,     ///< For information; nothing is wrong.
  kWarning,  ///< The run works, but worse than it could.
  kError,    ///< The run will not work.
};

/// "note", "warning" or "error".
[[nodiscard]] const char* to_string(Severity severity);

/// A statement on a recording, a network, or a run.
struct Finding {
  std::string id;  ///< Stable, for programs: "stereo.swapped".
  Severity severity = Severity::kNote;
  std::string what = {};   ///< One sentence with the number.
  std::string means = {};  ///< Consequence for the run.
  std::string to_do = {};  ///< Advice; empty if there is nothing to do.

  bool operator==(const Finding&) const = default;
};

/// Exit code of a program with these findings: 0 without warnings, 1 with warnings, 2 with an
/// error.
[[nodiscard]] int exit_code_of(std::span<const Finding> findings);

/// Sorts by descending severity; findings of equal severity keep their order.
void sort_by_severity(std::vector<Finding>& findings);

/// Text for people: "warning stereo.swapped: WHAT", and indented lines with the consequence and the
/// advice. Empty if there are no findings.
[[nodiscard]] std::string to_text(std::span<const Finding> findings);

/// Object with the keys id, severity, what, means and to_do.
void to_json(Json& json, const Finding& finding);
/// Inverse of to_json(). Missing texts become empty, a missing severity kNote. Throws
/// std::runtime_error for an unknown severity.
void from_json(const Json& json, Finding& finding);

}  // namespace km
