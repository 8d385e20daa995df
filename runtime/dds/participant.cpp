#include "runtime/dds/participant.hpp"

#include <algorithm>
#include <string_view>

#include "runtime/dds/cyclone_xml.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// DDS reports trouble with the network here, from its own threads.
void log_line(void* /*argument*/, const dds_log_data_t* data) {
  std::string_view text(data->message + data->hdrsize);
  while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  const bool severe = (data->priority & (DDS_LC_FATAL | DDS_LC_ERROR)) != 0;
  const auto level = severe ? log::Level::kError : log::Level::kWarn;
  // A dead link fails every packet alike: what is limited is the kind of message.
  log::limited(level, "dds", std::string(text.substr(0, 24))) << text;
}

NetworkInterface choose_interface(const DdsConfig& config) {
  const auto interfaces = network_interfaces();
  NetworkInterface chosen = select_interface(interfaces, config.interface);
  const auto outward = std::ranges::count(interfaces, false, &NetworkInterface::loopback);
  if (config.interface.empty() && outward > 1)
    log::warn("dds") << "several network interfaces are up: using " << chosen.name << " ("
                     << chosen.address << "); set dds.interface to choose";
  return chosen;
}

dds_entity_t create_participant(const DdsConfig& config, const RobotIdentity& identity) {
  const std::string user_data = to_user_data(identity);
  const DdsQos qos = make_dds_qos();
  dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  dds_qset_entity_name(qos.get(), identity.name.c_str());
  return dds_create_participant(static_cast<dds_domainid_t>(config.domain), qos.get(), nullptr);
}

}  // namespace

DdsDomain::DdsDomain(const DdsConfig& config)
    : config_(checked(config)), interface_(choose_interface(config_)) {
  check_hosts(config_.peers);
  dds_set_log_mask(DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING);
  dds_set_log_sink(&log_line, nullptr);
  domain_ = DdsEntity(
      dds_create_domain(static_cast<dds_domainid_t>(config_.domain),
                        cyclone_xml(config_, interface_).c_str()),
      "DDS domain " + std::to_string(config_.domain) + " on interface " + interface_.name);
}

DdsParticipant::DdsParticipant(const DdsConfig& config, const RobotIdentity& identity)
    : DdsParticipant(std::make_shared<const DdsDomain>(config), identity) {}

DdsParticipant::DdsParticipant(std::shared_ptr<const DdsDomain> domain,
                               const RobotIdentity& identity)
    : domain_(std::move(domain)),
      identity_(identity),
      participant_(create_participant(domain_->config(), identity),
                   "DDS participant (are there more than dds.max_participant_index robots on this "
                   "host?)") {}

}  // namespace km
