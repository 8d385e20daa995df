#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/stamp.hpp"

namespace km {

/// Regularity of the stamps of a topic. NaN if there are too few stamps.
struct StampStatistics {
  std::size_t count = 0;
  Stamp first = 0;       ///< The earliest [ns]; 0 without any.
  Stamp last = 0;        ///< The latest [ns]; 0 without any.
  double rate_hz = 0.0;  ///< Number of intervals over their total time.
  double largest_gap_s = 0.0;
  double jitter_s = 0.0;      ///< 95 % of the intervals differ from the median by no more.
  std::size_t unordered = 0;  ///< Stamps not later than the one before.
};

/// `stamps` in the order in which they were recorded; intervals are those of the sorted ones.
[[nodiscard]] StampStatistics stamp_statistics(std::vector<Stamp> stamps);

/// Agreement of the stamps of two topics with one rate. The stamps of a synchronised camera pair
/// are equal, or differ by a constant.
struct StampAgreement {
  std::size_t pairs = 0;             ///< Stamps of the one with the nearest of the other.
  std::size_t equal = 0;             ///< Pairs whose stamps are the same.
  double median_offset_s = 0.0;      ///< Second minus first; NaN without pairs.
  double largest_deviation_s = 0.0;  ///< Largest deviation of an offset from the median; NaN
                                     ///< without pairs.
  std::size_t only_first = 0;        ///< Without a stamp of the other within half an interval.
  std::size_t only_second = 0;
};

/// Agreement of two sorted lists of stamps. Pairs are stamps that are each other's nearest and at
/// most `tolerance_s` apart.
[[nodiscard]] StampAgreement stamp_agreement(std::span<const Stamp> first,
                                             std::span<const Stamp> second, double tolerance_s);

}  // namespace km
