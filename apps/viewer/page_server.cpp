#include "apps/viewer/page_server.hpp"

#include <arpa/inet.h>
#include <civetweb.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "modules/core/json.hpp"
#include "runtime/dds/participant.hpp"

namespace km {
namespace {

constexpr std::size_t kBatchBytes = 1 << 18;
constexpr double kWait_s = 0.2;
// Each open connection occupies one thread of the server. A connection is closed if no request
// arrives, or a page does not read, for kIdle_ms. Otherwise idle connections would
// keep pages waiting for the default of 30 s.
constexpr const char* kConnections = "192";
constexpr const char* kIdle_ms = "10000";
// Open pages in all and of one address: the other threads serve files.
constexpr std::size_t kMaxPages = 96, kMaxPagesOfAddress = 48;
constexpr std::size_t kMaxRequest_bytes = 1024;  // a longer request closes the connection
constexpr std::size_t kMaxImages = 64;           // robots whose images a page requests

// False for names that only begin like an address, as 127.example.com.
bool is_loopback(const std::string& address) {
  in_addr ip{};
  constexpr std::uint32_t kFirstOctet = 127;
  return address == "localhost" || address == "::1" ||
         (inet_pton(AF_INET, address.c_str(), &ip) == 1 && ntohl(ip.s_addr) >> 24U == kFirstOctet);
}

// 128 random bits as hexadecimal digits.
std::string random_token() {
  if (sodium_init() < 0) throw std::runtime_error("no random numbers for a token");
  std::array<unsigned char, 16> bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  std::array<char, 33> text{};
  sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
  return text.data();
}

const char* type_of(std::string_view path) {
  if (path.ends_with(".js")) return "text/javascript; charset=utf-8";
  if (path.ends_with(".css")) return "text/css; charset=utf-8";
  return "text/html; charset=utf-8";
}

// "localhost" of "localhost:8777", "[::1]" of "[::1]:8777".
std::string host_of(std::string_view authority) {
  const std::size_t colon = authority.rfind(':');
  const bool has_port =
      colon != std::string_view::npos && authority.find(']', colon) == std::string_view::npos;
  return std::string(authority.substr(0, has_port ? colon : authority.size()));
}

std::string_view header(const mg_connection* connection, const char* name) {
  const char* const value = mg_get_header(connection, name);
  return value != nullptr ? value : "";
}

bool send(mg_connection* connection, int kind, std::string_view bytes) {
  return mg_websocket_write(connection, kind, bytes.data(), bytes.size()) > 0;
}

// Request of a page: {"images": robot, "on": true}. Other text is no request.
struct ImageRequest {
  RobotId robot = 0;
  bool on = false;
};
std::optional<ImageRequest> parse_image_request(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("images") || !json.contains("on")) return std::nullopt;
  if (!json["images"].is_number_unsigned() || !json["on"].is_boolean()) return std::nullopt;
  const auto robot = json["images"].get<std::uint64_t>();
  if (robot > std::numeric_limits<RobotId>::max()) return std::nullopt;
  return ImageRequest{static_cast<RobotId>(robot), json["on"].get<bool>()};
}

int refuse(mg_connection* connection) {
  mg_send_http_error(connection, 404, "%s", "Nothing is here. The viewer prints its address.");
  return 404;
}

int answer(mg_connection* connection, const char* type, std::string_view bytes) {
  mg_printf(connection,
            "HTTP/1.1 200 OK\r\nContent-Type: %s\r\nContent-Length: %zu\r\n"
            "Cache-Control: no-cache\r\nX-Content-Type-Options: nosniff\r\n"
            "Content-Security-Policy: default-src 'self'; style-src 'self' 'unsafe-inline'; "
            "img-src 'self' blob: data:\r\nReferrer-Policy: no-referrer\r\n"
            "Connection: close\r\n\r\n",
            type, bytes.size());
  mg_write(connection, bytes.data(), bytes.size());
  return 200;
}

bool send_batch(mg_connection* connection, const ViewStore::Batch& batch) {
  std::string text;
  const auto flush = [&] {
    const bool ok = text.empty() || send(connection, MG_WEBSOCKET_OPCODE_TEXT, text + ']');
    text.clear();
    return ok;
  };
  const auto add = [&](const std::string& one) { (text += text.empty() ? '[' : ',') += one; };
  for (const auto& message : batch.messages) {
    if (!message->binary) {
      add(message->bytes);
    } else if (!flush() || !send(connection, MG_WEBSOCKET_OPCODE_BINARY, message->bytes)) {
      return false;
    }
  }
  if (!batch.forgotten.empty())
    add(Json{{"kind", "forgotten"}, {"numbers", batch.forgotten}}.dump());
  return flush();
}

}  // namespace

// An open page; its thread sends the messages that the page lacks.
struct PageServer::Page {
  std::string address;
  std::atomic<bool> closed = false;
  std::set<RobotId> images;  // robots whose images the page requests
  std::thread sender;
};

PageServer::PageServer(ViewStore& store, PageServerOptions options)
    : store_(store),
      options_(std::move(options)),
      token_(is_loopback(options_.address) ? "" : random_token()) {
  start();
}

PageServer::~PageServer() {
  stopping_ = true;
  mg_stop(context_);  // closes all connections, which ends their threads
  mg_exit_library();
}

std::string PageServer::url() const {
  std::array<mg_server_port, 4> ports{};
  const int count = mg_get_server_ports(context_, static_cast<int>(ports.size()), ports.data());
  const int port = count > 0 ? ports[0].port : options_.port;
  const bool any = options_.address == "0.0.0.0" || options_.address == "::";
  const std::string host =
      any ? select_interface(network_interfaces(), {}).address : options_.address;
  return "http://" + (host.find(':') != std::string::npos ? '[' + host + ']' : host) + ':' +
         std::to_string(port) + prefix();
}

void PageServer::start() {
  mg_init_library(0);
  const std::string host = options_.address.find(':') != std::string::npos
                               ? '[' + options_.address + ']'
                               : options_.address;
  const std::string port = host + ':' + std::to_string(options_.port);
  const std::array<const char*, 15> settings = {"listening_ports",
                                                port.c_str(),
                                                "num_threads",
                                                kConnections,
                                                "request_timeout_ms",
                                                kIdle_ms,
                                                "websocket_timeout_ms",
                                                "10000",
                                                "enable_websocket_ping_pong",
                                                "yes",
                                                "tcp_nodelay",
                                                "1",
                                                "enable_directory_listing",
                                                "no",
                                                nullptr};
  mg_init_data init{};
  mg_callbacks callbacks{};
  callbacks.log_message = [](const mg_connection*, const char*) { return 1; };
  init.callbacks = &callbacks;
  init.user_data = this;
  init.configuration_options = const_cast<const char**>(settings.data());
  std::array<char, 256> text{};
  mg_error_data error{};
  error.text = text.data();
  error.text_buffer_size = text.size();
  context_ = mg_start2(&init, &error);
  if (context_ == nullptr) {
    mg_exit_library();
    throw std::runtime_error("cannot listen on " + port +
                             ": is the address one of this host, the port free? (--port)");
  }
  mg_set_request_handler(
      context_, "/",
      [](mg_connection* connection, void* self) {
        return static_cast<PageServer*>(self)->serve(connection);
      },
      this);
  mg_set_websocket_handler(
      context_, (prefix() + "updates").c_str(),
      [](const mg_connection* connection, void* self) {
        return static_cast<PageServer*>(self)->has_room_for(connection) ? 0 : 1;
      },
      [](mg_connection* connection, void* self) {
        static_cast<PageServer*>(self)->open(connection);
      },
      [](mg_connection* connection, int bits, char* data, size_t size, void* self) {
        if (size > kMaxRequest_bytes) return 0;
        static_cast<PageServer*>(self)->receive(connection, bits, {data, size});
        return (bits & 0xf) == MG_WEBSOCKET_OPCODE_CONNECTION_CLOSE ? 0 : 1;
      },
      [](const mg_connection* connection, void* self) {
        static_cast<PageServer*>(self)->close(connection);
      },
      this);
}

// False for requests from pages of other sites. Without a token, also false for requests under a
// name that is not one of this host.
bool PageServer::is_allowed(const mg_connection* connection) const {
  const std::string_view host = header(connection, "Host"), origin = header(connection, "Origin");
  if (!origin.empty() && origin != "http://" + std::string(host)) return false;
  const std::string name = host_of(host);
  return !token_.empty() || name == "[::1]" || is_loopback(name);
}

bool PageServer::has_room_for(const mg_connection* connection) {
  const std::string address = mg_get_request_info(connection)->remote_addr;
  const std::lock_guard lock(mutex_);
  const auto of_address = std::ranges::count_if(
      pages_, [&](const auto& entry) { return entry.second->address == address; });
  return is_allowed(connection) && pages_.size() < kMaxPages &&
         std::cmp_less(of_address, kMaxPagesOfAddress);
}

int PageServer::serve(mg_connection* connection) const {
  const std::string uri = mg_get_request_info(connection)->local_uri;
  if (!is_allowed(connection) || !uri.starts_with(prefix())) return refuse(connection);
  std::string path = uri.substr(prefix().size());
  if (path.empty()) path = "index.html";
  for (const PageFile& file : page_files()) {
    if (file.path == path) return answer(connection, type_of(path), file.bytes);
  }
  return refuse(connection);
}

void PageServer::open(mg_connection* connection) {
  const std::lock_guard lock(mutex_);
  const auto page = std::make_shared<Page>();
  page->address = mg_get_request_info(connection)->remote_addr;
  pages_[connection] = page;
  page->sender = std::thread([this, connection, page] { send_messages(connection, *page); });
}

// Each text frame is a JSON array of messages; the first one has only the hello message. Each
// binary message has a frame of its own.
void PageServer::send_messages(mg_connection* connection, const Page& page) {
  if (!send(connection, MG_WEBSOCKET_OPCODE_TEXT, '[' + options_.hello + ']')) return;
  ViewStore::Cursor cursor;
  bool caught_up = false;
  while (!page.closed && !stopping_) {
    const ViewStore::Batch batch = store_.take(cursor, kBatchBytes, kWait_s);
    if (!send_batch(connection, batch)) return;
    if (batch.caught_up && !caught_up)
      send(connection, MG_WEBSOCKET_OPCODE_TEXT, R"([{"kind":"caught_up"}])");
    caught_up = caught_up || batch.caught_up;
  }
}

void PageServer::receive(mg_connection* connection, int bits, std::string_view text) {
  if ((bits & 0xf) != MG_WEBSOCKET_OPCODE_TEXT) return;
  const auto request = parse_image_request(text);
  if (!request) return;
  const std::lock_guard lock(mutex_);
  const auto page = pages_.find(connection);
  if (page == pages_.end()) return;
  std::set<RobotId>& images = page->second->images;
  change_requests([&] {
    if (!request->on)
      images.erase(request->robot);
    else if (images.size() < kMaxImages)
      images.insert(request->robot);
  });
}

// Applies `change` to the requests of pages. Calls on_images if the set of robots whose images
// are requested has changed. The caller holds mutex_, so that the calls are in the order of the
// changes.
void PageServer::change_requests(const std::function<void()>& change) {
  const std::set<RobotId> before = requested();
  change();
  if (const std::set<RobotId> now = requested(); options_.on_images && now != before)
    options_.on_images(now);
}

std::set<RobotId> PageServer::requested() const {
  std::set<RobotId> robots;
  for (const auto& [connection, page] : pages_)
    robots.insert(page->images.begin(), page->images.end());
  return robots;
}

void PageServer::close(const mg_connection* connection) {
  std::shared_ptr<Page> page;
  {
    const std::lock_guard lock(mutex_);
    const auto known = pages_.find(connection);
    if (known == pages_.end()) return;
    page = known->second;
    change_requests([&] { pages_.erase(known); });
  }
  page->closed = true;
  page->sender.join();
}

}  // namespace km
