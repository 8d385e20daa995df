#include "modules/evaluation/images/image_figure.hpp"

#include <limits>
#include <numeric>

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
      std::string label = "p";  // not "p" + ...: GCC 12 warns of its own string addition
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

}  // namespace km
