#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/camera/image_size.hpp"
#include "modules/core/stamp.hpp"
#include "modules/recordings/bag_reader.hpp"

namespace km {

/// Regularity of the stamps of a topic. NaN if there are too few stamps.
struct StampStatistics {
  std::size_t count = 0;
  Stamp first = 0;       ///< Earliest stamp [ns]; 0 without stamps.
  Stamp last = 0;        ///< Latest stamp [ns]; 0 without stamps.
  double rate_hz = 0.0;  ///< Number of intervals over their total time.
  double largest_gap_s = 0.0;
  Stamp gap_from = 0;         ///< Start of the largest gap; 0 without one.
  double median_s = 0.0;      ///< Median of the intervals.
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

/// The first image of a topic.
struct TopicImage {
  ImageSize size;
  std::string encoding;    ///< "mono8", "jpeg", ...
  std::string frame = {};  ///< Frame in the header.
};

/// nullopt if the message is not an image of its channel's type.
[[nodiscard]] std::optional<TopicImage> topic_image(const BagChannel& channel,
                                                    const BagMessage& message);

/// A topic of a recording.
struct TopicSummary {
  std::string topic;
  std::string type;
  std::string encoding = {};
  bool has_sensor_stamps = false;  ///< Stamps are from message headers; else they are log times.
  std::vector<Stamp> stamps = {};  ///< Stamps in the order of the recording [ns].
  bool is_image = false;
  std::optional<TopicImage> image = {};
  std::size_t undecoded = 0;  ///< Number of messages that are not of their type, without a stamp.
};

/// Two topics of images with about the same rate.
struct TopicPair {
  std::string first, second;
  StampAgreement agreement;
};

/// Summarises all remaining messages. Returns topics in the order of the channels; a topic may have
/// several channels. Takes 8 bytes for each message.
[[nodiscard]] std::vector<TopicSummary> summarise_topics(BagReader& reader);

/// All pairs of image topics whose rates differ by at most 5 %. Two stamps belong together if they
/// are less than half an interval apart.
[[nodiscard]] std::vector<TopicPair> pairs_of_images(const std::vector<TopicSummary>& topics);

}  // namespace km
