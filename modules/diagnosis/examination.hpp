#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "modules/diagnosis/finding.hpp"

namespace km {

/// A measured number as text with its unit, or the reason why it is not determined.
struct Figure {
  std::string name;
  std::string value;
};

/// The figures of an examination and its findings.
struct Examination {
  std::vector<Figure> figures;
  std::vector<Finding> findings;

  void add(Examination other) {
    figures.insert(figures.end(), other.figures.begin(), other.figures.end());
    findings.insert(findings.end(), other.findings.begin(), other.findings.end());
  }
};

/// One aligned line of text per figure.
[[nodiscard]] std::string to_text(const std::vector<Figure>& figures);

/// True if a finding has this id.
[[nodiscard]] bool has(const Examination& examination, std::string_view id);

}  // namespace km
