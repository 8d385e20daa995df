#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "modules/diagnosis/finding.hpp"

namespace km {

/// A number that was measured, as text with its unit; or "not told: why".
struct Figure {
  std::string name;
  std::string value;
};

/// What was looked at, and what of it stands out.
struct Examination {
  std::vector<Figure> figures;
  std::vector<Finding> findings;

  void add(Examination other) {
    figures.insert(figures.end(), other.figures.begin(), other.figures.end());
    findings.insert(findings.end(), other.findings.begin(), other.findings.end());
  }
};

/// A line per figure, aligned.
[[nodiscard]] std::string to_text(const std::vector<Figure>& figures);

/// True if a finding has this id.
[[nodiscard]] bool has(const Examination& examination, std::string_view id);

}  // namespace km
