#include "modules/evaluation/images/image_report.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <optional>
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

// other / reference; NaN where either is not to be had.
double ratio_of(const ImageFigure& reference, const ImageFigure& other) {
  return other.value / reference.value;
}

// Whether the two differ by more than kMarkedDifference; nullopt: not judged.
std::optional<bool> differs(const ImageFigure& reference, const ImageFigure& other) {
  const double ratio = ratio_of(reference, other);
  if (!std::isfinite(ratio) || is_amount(reference)) return std::nullopt;
  return std::abs(ratio - 1.0) > kMarkedDifference;
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
    out << std::setw(kValueWidth) << number(ratio_of(figure, *partner), 2);
    if (const auto is_marked = differs(figure, *partner)) {
      all.add(*is_marked);
      if (is_at_flow(figure)) like_flow.add(*is_marked);
      if (*is_marked) out << "  <--";
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

void write_comparison(JsonWriter& json, std::span<const ImageFigure> reference,
                      std::span<const ImageFigure> other) {
  Count all;
  json.begin_object();
  json.key("rows");
  json.begin_array();
  for (const ImageFigure& figure : reference) {
    const ImageFigure* const partner = find(other, figure);
    if (partner == nullptr) continue;
    json.begin_object();
    json.field("section", figure.section);
    json.field("name", figure.name);
    json.field("reference", figure.value);
    json.field("other", partner->value);
    json.field("ratio", ratio_of(figure, *partner));
    const auto is_marked = differs(figure, *partner);
    if (is_marked) {
      all.add(*is_marked);
      json.field("differs", *is_marked);
    } else {
      json.field("differs", std::numeric_limits<double>::quiet_NaN());
    }
    json.end_object();
  }
  json.end_array();
  json.field("compared", all.rows);
  json.field("differing", all.marked);
  json.end_object();
}

}  // namespace km
