#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/json.hpp"

namespace km {

/// One measured property of a sequence of images: a row of the table.
struct ImageFigure {
  std::string section;  ///< Heading of the figure.
  std::string name;     ///< Unique in its section; contains quantity and unit.
  double value = 0.0;   ///< NaN: not available for this sequence.
  int decimals = 3;     ///< Decimals in tables.
};

/// Collects the figures of one section.
class FigureList {
 public:
  /// `figures` must outlive this object.
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

/// Ranges of a frame's median flow [px/frame] by which figures are grouped. Tracking depends on the
/// motion more than on anything else, so sequences are compared at similar flow.
inline constexpr std::array kFlowBinEdges_px = {0.0, 3.0, 6.0, 10.0, 15.0, 25.0, 60.0};
inline constexpr std::size_t kFlowBinCount = kFlowBinEdges_px.size() - 1;

/// A bin with fewer frames gives no mean.
inline constexpr int kMinFramesInBin = 3;

/// The bin of `flow_px`; nullopt beyond the last edge and for NaN.
[[nodiscard]] std::optional<std::size_t> flow_bin(double flow_px);

/// "flow 3-6 px".
[[nodiscard]] std::string flow_bin_name(std::size_t bin);

/// Means of one quantity per flow bin.
class FlowBinMeans {
 public:
  void add(double flow_px, double value);
  [[nodiscard]] int count(std::size_t bin) const { return counts_[bin]; }
  /// NaN for a bin with less than kMinFramesInBin values.
  [[nodiscard]] double mean(std::size_t bin) const;

 private:
  std::array<double, kFlowBinCount> sums_{};
  std::array<int, kFlowBinCount> counts_{};
};

/// Rows that differ by more than this share of the reference are marked.
inline constexpr double kMarkedDifference = 0.25;

/// A table for people: one row per figure under the heading of its section; "-" for unavailable
/// figures.
[[nodiscard]] std::string to_table(std::span<const ImageFigure> figures);

/// Compares two sequences in a table, with the ratio other / reference. Rows that differ by more
/// than kMarkedDifference of the reference end with `<--`, except for counts of frames. Figures
/// that only one of the sequences has are dropped. The last line counts the compared and marked
/// rows, in total and among those at equal flow (one bin of the median flow).
[[nodiscard]] std::string to_comparison(std::span<const ImageFigure> reference,
                                        std::span<const ImageFigure> other,
                                        const std::string& reference_name,
                                        const std::string& other_name);

/// One JSON object: {section: {name: value, ...}, ...}; null for unavailable figures.
[[nodiscard]] Json to_json(std::span<const ImageFigure> figures);

/// The comparison as one JSON object: {"rows": [{"section", "name", "reference", "other", "ratio",
/// "differs"}, ...], "compared", "differing"}. "differs" is null for rows that are not judged:
/// amounts, and rows without a ratio.
[[nodiscard]] Json comparison_json(std::span<const ImageFigure> reference,
                                   std::span<const ImageFigure> other);

}  // namespace km
