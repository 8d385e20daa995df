#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/core/io/json.hpp"
#include "modules/core/io/text_table.hpp"

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

/// A measured number as text with its unit, or the reason why it is not determined.
struct Figure {
  std::string name;
  std::string value;
};

/// The figures of an examination and its findings.
struct Examination {
  std::vector<Figure> figures;
  std::vector<Finding> findings;

  void add(const Examination& other) {
    figures.insert(figures.end(), other.figures.begin(), other.figures.end());
    findings.insert(findings.end(), other.findings.begin(), other.findings.end());
  }
  /// Adds a finding; see Finding.
  void add(Severity severity, std::string id, std::string what, std::string means,
           std::string to_do = {}) {
    findings.push_back(
        {std::move(id), severity, std::move(what), std::move(means), std::move(to_do)});
  }
  void figure(std::string name, std::string value) {
    figures.push_back({std::move(name), std::move(value)});
  }
};

/// One aligned line of text per figure.
[[nodiscard]] std::string to_text(const std::vector<Figure>& figures);

/// True if a finding has this id.
[[nodiscard]] bool has(const Examination& examination, std::string_view id);

/// "5.3 %" for 0.053, "12 %" for 0.12.
[[nodiscard]] inline std::string percent(double share) {
  return fixed(100.0 * share, share < 0.1 ? 1 : 0) + " %";
}

/// "1.5 ms" for 0.0015.
[[nodiscard]] inline std::string milliseconds(double seconds) {
  return fixed(1e3 * seconds, 1) + " ms";
}

}  // namespace km
