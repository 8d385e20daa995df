#include "modules/evaluation/images/image_figure.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>

#include "modules/core/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

std::string quantile_label(int percent) {
  switch (percent) {
    case 0:
      return "min";
    case 50:
      return "median";
    case 100:
      return "max";
    default:
      std::string label = "p";  // not "p" + ...: GCC 12 warns about its own string addition
      return label += std::to_string(percent);
  }
}

}  // namespace

void FigureList::add(const std::string& name, double value, int decimals) {
  figures_.push_back({section_, name, value, decimals});
}

void FigureList::add_quantiles(const std::string& name, const std::vector<double>& values,
                               const std::vector<int>& percents, int decimals) {
  for (const int p : percents) {
    const std::string label = quantile_label(p);
    add(name.empty() ? label : name + ' ' + label, quantile(values, 0.01 * p), decimals);
  }
}

double mean_of(const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::optional<std::size_t> flow_bin(double flow_px) {
  for (std::size_t bin = 0; bin < kFlowBinCount; ++bin)
    if (flow_px >= kFlowBinEdges_px[bin] && flow_px < kFlowBinEdges_px[bin + 1]) return bin;
  return std::nullopt;
}

std::string flow_bin_name(std::size_t bin) {
  return "flow " + std::to_string(static_cast<int>(kFlowBinEdges_px[bin])) + '-' +
         std::to_string(static_cast<int>(kFlowBinEdges_px[bin + 1])) + " px";
}

void FlowBinMeans::add(double flow_px, double value) {
  if (const auto bin = flow_bin(flow_px)) {
    sums_[*bin] += value;
    ++counts_[*bin];
  }
}

double FlowBinMeans::mean(std::size_t bin) const {
  if (counts_[bin] < kMinFramesInBin) return std::numeric_limits<double>::quiet_NaN();
  return sums_[bin] / counts_[bin];
}

namespace {

constexpr int kNameWidth = 48;
constexpr int kValueWidth = 12;

const ImageFigure* find(std::span<const ImageFigure> figures, const ImageFigure& like) {
  const auto found = std::find_if(figures.begin(), figures.end(), [&](const ImageFigure& figure) {
    return figure.section == like.section && figure.name == like.name;
  });
  return found != figures.end() ? &*found : nullptr;
}

// True for amounts of data, which are not properties of the images.
bool is_amount(const ImageFigure& figure) {
  return figure.section == "sequence" || figure.name.starts_with("frames, ") ||
         figure.name == "pairs of images";
}

bool is_at_flow(const ImageFigure& figure) {
  return figure.name.find("flow ") != figure.name.npos;
}

// other / reference; NaN if either is missing.
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
    out << std::setw(kValueWidth) << fixed(figure.value, figure.decimals) << '\n';
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
    out << std::setw(kValueWidth) << fixed(figure.value, figure.decimals) << std::setw(kValueWidth)
        << fixed(partner->value, figure.decimals);
    out << std::setw(kValueWidth) << fixed(ratio_of(figure, *partner), 2);
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

Json to_json(std::span<const ImageFigure> figures) {
  Json json = Json::object();
  for (const ImageFigure& figure : figures) json[figure.section][figure.name] = figure.value;
  return json;
}

Json comparison_json(std::span<const ImageFigure> reference, std::span<const ImageFigure> other) {
  Count all;
  Json rows = Json::array();
  for (const ImageFigure& figure : reference) {
    const ImageFigure* const partner = find(other, figure);
    if (partner == nullptr) continue;
    const auto is_marked = differs(figure, *partner);
    if (is_marked) all.add(*is_marked);
    rows.push_back({{"section", figure.section},
                    {"name", figure.name},
                    {"reference", figure.value},
                    {"other", partner->value},
                    {"ratio", ratio_of(figure, *partner)},
                    {"differs", is_marked ? Json(*is_marked) : Json()}});
  }
  return {{"rows", std::move(rows)}, {"compared", all.rows}, {"differing", all.marked}};
}

}  // namespace km
