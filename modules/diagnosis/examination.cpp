#include "modules/diagnosis/examination.hpp"

#include <algorithm>

namespace km {

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
