#include "modules/recordings/merged_reader.hpp"

#include <utility>

namespace km {

MergedReader::MergedReader(std::vector<std::unique_ptr<BagReader>> readers) {
  for (auto& reader : readers) {
    Source source{.reader = std::move(reader), .channel_of = {}, .head = {}};
    for (const BagChannel& channel : source.reader->channels())
      source.channel_of.push_back(channels_.add(channel));
    sources_.push_back(std::move(source));
  }
  for (Source& source : sources_) advance(source);
}

void MergedReader::advance(Source& source) {
  source.head = source.reader->next();
  if (!source.head) return;
  const auto& channels = source.reader->channels();  // perhaps more than before next()
  for (std::size_t i = source.channel_of.size(); i < channels.size(); ++i)
    source.channel_of.push_back(channels_.add(channels[i]));
  source.head->channel = source.channel_of[source.head->channel];
}

std::optional<BagMessage> MergedReader::next() {
  Source* first = nullptr;
  for (Source& source : sources_)
    if (source.head && (first == nullptr || source.head->log_time < first->head->log_time))
      first = &source;
  if (first == nullptr) return std::nullopt;
  BagMessage message = *std::move(first->head);
  advance(*first);
  return message;
}

BagReport MergedReader::report() const {
  BagReport report;
  for (const Source& source : sources_) report.add(source.reader->report());
  return report;
}

}  // namespace km
