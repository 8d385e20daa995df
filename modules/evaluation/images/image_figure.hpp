#pragma once

#include <string>
#include <vector>

namespace km {

/// One measured property of a sequence of images: a row of the table.
struct ImageFigure {
  std::string section;  ///< Heading it stands under.
  std::string name;     ///< Unique in its section; says what and in which unit.
  double value = 0.0;   ///< NaN: not to be had from this sequence.
  int decimals = 3;     ///< Shown to people.
};

/// Collects the figures of one section.
class FigureList {
 public:
  /// `figures` outlives this.
  FigureList(std::vector<ImageFigure>& figures, std::string section)
      : figures_(figures), section_(std::move(section)) {}

  void add(const std::string& name, double value, int decimals = 3);

  /// Rows "`name` median" and so on for the quantiles of a sample, p in percent; 50: median.
  void add_quantiles(const std::string& name, const std::vector<double>& values,
                     const std::vector<int>& percents, int decimals = 3);

 private:
  std::vector<ImageFigure>& figures_;
  std::string section_;
};

/// Arithmetic mean; NaN for an empty sample.
[[nodiscard]] double mean_of(const std::vector<double>& values);

}  // namespace km
