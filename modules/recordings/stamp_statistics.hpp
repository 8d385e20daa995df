#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/stamp.hpp"

namespace km {

/// Regularity of the stamps of a topic. NaN if there are too few stamps.
struct StampStatistics {
  std::size_t count = 0;
  Stamp first = 0;       ///< Earliest stamp [ns]; 0 without stamps.
  Stamp last = 0;        ///< Latest stamp [ns]; 0 without stamps.
  double rate_hz = 0.0;  ///< Number of intervals over their total time.
  double largest_gap_s = 0.0;
  double jitter_s = 0.0;      ///< 95 % quantile of the intervals' distance from their median.
  std::size_t unordered = 0;  ///< Number of stamps not later than the previous stamp.
};

/// `stamps` are in the order of the recording. Intervals are between sorted stamps.
[[nodiscard]] StampStatistics stamp_statistics(std::vector<Stamp> stamps);

/// Agreement of the stamps of two topics with about the same rate. The stamps of a synchronised
/// camera pair are equal, or differ by a constant.
struct StampAgreement {
  std::size_t pairs = 0;             ///< Number of pairs, see stamp_agreement().
  std::size_t equal = 0;             ///< Number of pairs with equal stamps.
  double median_offset_s = 0.0;      ///< Second minus first; NaN without pairs.
  double largest_deviation_s = 0.0;  ///< Largest deviation of an offset from the median; NaN
                                     ///< without pairs.
  std::size_t only_first = 0;        ///< Number of stamps of the first list without a pair.
  std::size_t only_second = 0;       ///< Number of stamps of the second list without a pair.
};

/// Agreement of two sorted lists of stamps. Pairs are stamps that are each other's nearest and at
/// most `tolerance_s` apart.
[[nodiscard]] StampAgreement stamp_agreement(std::span<const Stamp> first,
                                             std::span<const Stamp> second, double tolerance_s);

}  // namespace km
