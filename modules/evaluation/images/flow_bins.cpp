#include "modules/evaluation/images/flow_bins.hpp"

namespace km {

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

}  // namespace km
