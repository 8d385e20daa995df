#pragma once

#include <cstddef>
#include <vector>

namespace km {

/// Summary of a sample of magnitudes. All values are zero for an empty sample.
struct Statistics {
  std::size_t count = 0;
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;  ///< Mean of the middle two for an even count.
  double max = 0.0;
};

[[nodiscard]] Statistics statistics_of(std::vector<double> values);

}  // namespace km
