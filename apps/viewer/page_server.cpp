#include "apps/viewer/page_server.hpp"

#include <arpa/inet.h>
#include <civetweb.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "modules/core/io/json.hpp"
#include "runtime/clock.hpp"
#include "runtime/dds/participant.hpp"

namespace km {
namespace {

constexpr std::size_t kBatchBytes = 1 << 18;
constexpr double kWait_s = 0.2;
// Each open connection occupies one thread of the server, and further ones wait for a thread. A
// connection is closed if its request takes longer than kRequest_s. It is also closed if a file is
// not read for kRequest_s, or a page for kIdle_s: the number of pages is limited.
constexpr const char* kConnections = "192";
constexpr const char* kRequest_ms = "1000";
constexpr double kRequest_s = 1.0, kIdle_s = 10.0;
// Open pages in all and of one address: the other threads serve files.
constexpr std::size_t kMaxPages = 96, kMaxPagesOfAddress = 48;
constexpr std::size_t kMaxImages = 64;  // robots whose images a page requests

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

std::string parameter(const mg_connection* connection, const char* name) {
  const char* const query = mg_get_request_info(connection)->query_string;
  std::array<char, 64> value{};
  if (query == nullptr ||
      mg_get_var(query, std::strlen(query), name, value.data(), value.size()) < 0)
    return {};
  return value.data();
}

// False if the page has gone or does not read. mg_write() gives up earlier.
bool write_to_page(mg_connection* connection, std::string_view bytes) {
  for (double read_s = steady_now_s(); !bytes.empty();) {
    const double start_s = steady_now_s();
    const int written = mg_write(connection, bytes.data(), bytes.size());
    const double now_s = steady_now_s();
    if (written > 0)
      read_s = now_s;
    else if (now_s - start_s < kRequest_s || now_s - read_s > kIdle_s)
      return false;
    bytes.remove_prefix(static_cast<std::size_t>(std::max(written, 0)));
  }
  return true;
}

// Sends a frame: four bytes, in which the lowest bit stands for binary data and the others for the
// size, and the data. False if the page has gone or does not read.
bool send(mg_connection* connection, bool binary, std::string_view bytes) {
  std::string frame;
  const std::size_t head = bytes.size() << 1U | (binary ? 1U : 0U);
  for (unsigned k = 0; k < 32; k += 8) frame += static_cast<char>(head >> k);
  frame.append(bytes);
  return write_to_page(connection, frame);
}

int refuse(mg_connection* connection) {
  mg_send_http_error(connection, 404, "%s", "Nothing is here. The viewer prints its address.");
  return 404;
}

// Without a size the answer continues until the connection is closed.
void begin_answer(mg_connection* connection, const char* type, std::optional<std::size_t> size) {
  mg_printf(connection,
            "HTTP/1.1 200 OK\r\nContent-Type: %s\r\n%s"
            "Cache-Control: no-cache\r\nX-Content-Type-Options: nosniff\r\n"
            "Content-Security-Policy: default-src 'self'; style-src 'self' 'unsafe-inline'; "
            "img-src 'self' blob: data:\r\nReferrer-Policy: no-referrer\r\n"
            "Connection: close\r\n\r\n",
            type, size ? ("Content-Length: " + std::to_string(*size) + "\r\n").c_str() : "");
}

int answer(mg_connection* connection, const char* type, std::string_view bytes) {
  begin_answer(connection, type, bytes.size());
  mg_write(connection, bytes.data(), bytes.size());
  return 200;
}

bool send_batch(mg_connection* connection, const ViewStore::Batch& batch) {
  std::string text;
  const auto flush = [&] {
    const bool ok = text.empty() || send(connection, false, text + ']');
    text.clear();
    return ok;
  };
  const auto add = [&](const std::string& one) { (text += text.empty() ? '[' : ',') += one; };
  for (const auto& message : batch.messages) {
    if (!message->binary) {
      add(message->bytes);
    } else if (!flush() || !send(connection, true, message->bytes)) {
      return false;
    }
  }
  if (!batch.forgotten.empty())
    add(Json{{"kind", "forgotten"}, {"numbers", batch.forgotten}}.dump());
  return flush();
}

}  // namespace

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
  const std::array<const char*, 11> settings = {
      "listening_ports",          port.c_str(), "num_threads", kConnections,
      "request_timeout_ms",       kRequest_ms,  "tcp_nodelay", "1",
      "enable_directory_listing", "no",         nullptr};
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
}

// False for requests from pages of other sites. Without a token, also false for requests under a
// name that is not one of this host.
bool PageServer::is_allowed(const mg_connection* connection) const {
  const std::string_view host = header(connection, "Host"), origin = header(connection, "Origin");
  if (!origin.empty() && origin != "http://" + std::string(host)) return false;
  const std::string name = host_of(host);
  return !token_.empty() || name == "[::1]" || is_loopback(name);
}

int PageServer::serve(mg_connection* connection) {
  const std::string uri = mg_get_request_info(connection)->local_uri;
  if (!is_allowed(connection) || !uri.starts_with(prefix())) return refuse(connection);
  std::string path = uri.substr(prefix().size());
  // With POST every browser names the site of the page, so that other sites are refused.
  if (mg_get_request_info(connection)->request_method == std::string_view("POST")) {
    if (path == "updates") return send_messages(connection);
    return path == "images" ? request_images(connection) : refuse(connection);
  }
  if (path.empty()) path = "index.html";
  for (const PageFile& file : page_files()) {
    if (file.path == path) return answer(connection, type_of(path), file.bytes);
  }
  return refuse(connection);
}

// Each text frame is a JSON array of messages; the first one has only the hello message. Each
// binary message has a frame of its own. An empty frame shows whether the page is still there.
int PageServer::send_messages(mg_connection* connection) {
  const std::string id = parameter(connection, "page");
  if (!open(id, mg_get_request_info(connection)->remote_addr)) {
    mg_send_http_error(connection, 503, "%s", "Too many pages are open: close one.");
    return 503;
  }
  begin_answer(connection, "application/octet-stream", {});
  bool there = send(connection, false, '[' + options_.hello + ']');
  ViewStore::Cursor cursor;
  bool caught_up = false;
  while (there && !stopping_) {
    const ViewStore::Batch batch = store_.take(cursor, kBatchBytes, kWait_s);
    there =
        send_batch(connection, batch) &&
        send(connection, false, batch.caught_up && !caught_up ? R"([{"kind":"caught_up"}])" : "");
    caught_up = caught_up || batch.caught_up;
  }
  const std::lock_guard lock(mutex_);
  change_requests([&] { pages_.erase(id); });
  return 200;
}

bool PageServer::open(const std::string& id, const std::string& address) {
  const std::lock_guard lock(mutex_);
  const auto of_address = std::ranges::count_if(
      pages_, [&](const auto& entry) { return entry.second.address == address; });
  return pages_.size() < kMaxPages && std::cmp_less(of_address, kMaxPagesOfAddress) &&
         pages_.try_emplace(id, Page{address, {}}).second;
}

int PageServer::request_images(mg_connection* connection) {
  const std::string text = parameter(connection, "robot"), on = parameter(connection, "on");
  RobotId robot = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), robot);
  const std::lock_guard lock(mutex_);
  const auto page = pages_.find(parameter(connection, "page"));
  if (page == pages_.end() || error != std::errc() || end != text.data() + text.size())
    return refuse(connection);
  std::set<RobotId>& images = page->second.images;
  change_requests([&] {
    if (on != "true")
      images.erase(robot);
    else if (images.size() < kMaxImages)
      images.insert(robot);
  });
  return answer(connection, "text/plain", "");
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
  for (const auto& [id, page] : pages_) robots.insert(page.images.begin(), page.images.end());
  return robots;
}

}  // namespace km
