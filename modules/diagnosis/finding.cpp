#include "modules/diagnosis/finding.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace km {
namespace {

// In the order of the enumerators.
constexpr std::array kSeverities = {"note", "warning", "error"};

Severity severity_of(const std::string& word) {
  const auto found = std::ranges::find(kSeverities, word);
  if (found == kSeverities.end())
    throw std::runtime_error("severity: " + word + " is neither note, warning nor error");
  return static_cast<Severity>(found - kSeverities.begin());
}

}  // namespace

const char* to_string(Severity severity) {
  return kSeverities[static_cast<std::size_t>(severity)];
}

int exit_code_of(std::span<const Finding> findings) {
  const auto gravest = std::ranges::max_element(findings, {}, &Finding::severity);
  return gravest == findings.end() ? 0 : static_cast<int>(gravest->severity);
}

void sort_by_severity(std::vector<Finding>& findings) {
  std::ranges::stable_sort(findings, std::ranges::greater{}, &Finding::severity);
}

std::string to_text(std::span<const Finding> findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += std::string(to_string(finding.severity)) + ' ' + finding.id + ": " + finding.what;
    text += "\n  means: " + finding.means + '\n';
    if (!finding.to_do.empty()) text += "  to do: " + finding.to_do + '\n';
  }
  return text;
}

void to_json(Json& json, const Finding& finding) {
  json = {{"id", finding.id},
          {"severity", to_string(finding.severity)},
          {"what", finding.what},
          {"means", finding.means},
          {"to_do", finding.to_do}};
}

void from_json(const Json& json, Finding& finding) {
  finding.id = json.value("id", "");
  finding.severity = severity_of(json.value("severity", to_string(Severity::kNote)));
  finding.what = json.value("what", "");
  finding.means = json.value("means", "");
  finding.to_do = json.value("to_do", "");
}

std::string to_text(const std::vector<Figure>& figures) {
  std::size_t width = 0;
  for (const Figure& figure : figures) width = std::max(width, figure.name.size());
  std::string text;
  for (const Figure& figure : figures)
    text += figure.name + std::string(width + 2 - figure.name.size(), ' ') + figure.value + '\n';
  return text;
}

bool has(const Examination& examination, std::string_view id) {
  return std::ranges::find(examination.findings, id, &Finding::id) != examination.findings.end();
}

}  // namespace km
