#pragma once

#include <span>
#include <string>
#include <vector>

#include "modules/core/json.hpp"

namespace km {

/// What a finding means for a run.
enum class Severity {
  kNote,     ///< Worth knowing; nothing is wrong.
  kWarning,  ///< It works, but worse than it could.
  kError,    ///< It will not work.
};

/// "note", "warning" or "error".
[[nodiscard]] const char* to_string(Severity severity);

/// Something that stands out, in words: of a recording, a network, or a run.
struct Finding {
  std::string id;  ///< Stable, for programs: "stereo.swapped".
  Severity severity = Severity::kNote;
  std::string what = {};   ///< One sentence with the number behind it.
  std::string means = {};  ///< What follows from it.
  std::string to_do = {};  ///< Empty where there is nothing to do.

  bool operator==(const Finding&) const = default;
};

/// The exit code of a program that found these: 0 without warnings, 1 with some, 2 with an error.
[[nodiscard]] int exit_code_of(std::span<const Finding> findings);

/// The gravest first, otherwise in their order.
void sort_by_severity(std::vector<Finding>& findings);

/// For people: "warning stereo.swapped: WHAT", and below it, indented, what it means and what to
/// do. Empty if there are none.
[[nodiscard]] std::string to_text(std::span<const Finding> findings);

/// {"id", "severity", "what", "means", "to_do"}.
void to_json(Json& json, const Finding& finding);
/// Throws std::runtime_error for a severity that is none; what `json` lacks stays empty.
void from_json(const Json& json, Finding& finding);

}  // namespace km
