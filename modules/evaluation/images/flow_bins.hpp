#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>

namespace km {

/// Ranges of a frame's median flow [px/frame] by which figures are told apart: tracking depends on
/// the motion more than on anything else, so sequences are compared at like flow.
inline constexpr std::array kFlowBinEdges_px = {0.0, 3.0, 6.0, 10.0, 15.0, 25.0, 60.0};
inline constexpr std::size_t kFlowBinCount = kFlowBinEdges_px.size() - 1;

/// Frames below which a bin says nothing.
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

}  // namespace km
