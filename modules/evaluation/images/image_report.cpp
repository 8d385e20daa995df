#include "modules/evaluation/images/image_report.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace km {
namespace {

constexpr int kNameWidth = 48;
constexpr int kValueWidth = 12;

std::string number(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(decimals) << value;
  return text.str();
}

const ImageFigure* find(std::span<const ImageFigure> figures, const ImageFigure& like) {
  const auto found = std::find_if(figures.begin(), figures.end(), [&](const ImageFigure& figure) {
    return figure.section == like.section && figure.name == like.name;
  });
  return found != figures.end() ? &*found : nullptr;
}

// How much was looked at, not what it is like.
bool is_amount(const ImageFigure& figure) {
  return figure.section == "sequence" || figure.name.starts_with("frames, ") ||
         figure.name == "pairs of images";
}

bool is_at_flow(const ImageFigure& figure) {
  return figure.name.find("flow ") != figure.name.npos;
}

struct Count {
  int rows = 0;
  int marked = 0;

  void add(bool is_marked) {
    ++rows;
    if (is_marked) ++marked;
  }
};

void begin_row(std::ostream& out, const ImageFigure& figure, std::string& section) {
  if (figure.section != section) out << (section.empty() ? "" : "\n") << figure.section << '\n';
  section = figure.section;
  out << "  " << std::left << std::setw(kNameWidth) << figure.name << std::right;
}

}  // namespace

std::string to_table(std::span<const ImageFigure> figures) {
  std::ostringstream out;
  std::string section;
  for (const ImageFigure& figure : figures) {
    begin_row(out, figure, section);
    out << std::setw(kValueWidth) << number(figure.value, figure.decimals) << '\n';
  }
  return out.str();
}

std::string to_comparison(std::span<const ImageFigure> reference,
                          std::span<const ImageFigure> other, const std::string& reference_name,
                          const std::string& other_name) {
  std::ostringstream out;
  std::string section;
  Count all;
  Count like_flow;
  out << "reference: " << reference_name << "\nother:     " << other_name << "\n\n"
      << std::setw(kNameWidth + 2 + kValueWidth) << "reference" << std::setw(kValueWidth) << "other"
      << std::setw(kValueWidth) << "ratio" << '\n';
  for (const ImageFigure& figure : reference) {
    const ImageFigure* const partner = find(other, figure);
    if (partner == nullptr) continue;
    begin_row(out, figure, section);
    out << std::setw(kValueWidth) << number(figure.value, figure.decimals) << std::setw(kValueWidth)
        << number(partner->value, figure.decimals);
    const double ratio = partner->value / figure.value;
    out << std::setw(kValueWidth) << number(ratio, 2);
    if (std::isfinite(ratio) && !is_amount(figure)) {
      const bool differs = std::abs(ratio - 1.0) > kMarkedDifference;
      all.add(differs);
      if (is_at_flow(figure)) like_flow.add(differs);
      if (differs) out << "  <--";
    }
    out << '\n';
  }
  out << '\n'
      << all.marked << " of " << all.rows << " rows differ by more than "
      << std::lround(100.0 * kMarkedDifference) << " %; of those at like flow " << like_flow.marked
      << " of " << like_flow.rows << '\n';
  return out.str();
}

void write_json(JsonWriter& json, std::span<const ImageFigure> figures) {
  json.begin_object();
  const std::string* section = nullptr;
  for (const ImageFigure& figure : figures) {
    if (section == nullptr || figure.section != *section) {
      if (section != nullptr) json.end_object();
      json.key(figure.section);
      json.begin_object();
      section = &figure.section;
    }
    json.field(figure.name, figure.value);
  }
  if (section != nullptr) json.end_object();
  json.end_object();
}

}  // namespace km
