#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "modules/recordings/bag_reader.hpp"

namespace km {

/// Channels with unique topic, type and encoding. Messages of a restarted publisher, or of another
/// file of the recording, belong to the same channel.
class ChannelTable {
 public:
  /// Adds a channel, or the message count of a known one, and returns its index.
  std::size_t add(const BagChannel& channel) {
    const auto [known, is_new] = index_.try_emplace(
        std::tuple(channel.topic, channel.type, channel.encoding), channels_.size());
    if (is_new)
      channels_.push_back(channel);
    else
      channels_[known->second].message_count += channel.message_count;
    return known->second;
  }

  [[nodiscard]] BagChannel& at(std::size_t index) { return channels_.at(index); }
  [[nodiscard]] const std::vector<BagChannel>& channels() const { return channels_; }

 private:
  std::vector<BagChannel> channels_;
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> index_;
};

}  // namespace km
