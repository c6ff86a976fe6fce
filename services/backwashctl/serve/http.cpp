// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/http.hpp"

#include <httplib.h>
#include <netinet/tcp.h>
#include <poll.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>

#include "services/backwashctl/serve/porch.hpp"
#include "services/command_line/exit_code.hpp"

namespace backwash::ctl {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kSlice_ms = 100;  // after which a wait looks whether all is to end

Clock::time_point in(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// One connection, with what it may cost: the library counts a timeout anew at each byte, so that 300 connections of a
/// byte a second held all of its threads, and a STOP got no answer within 5 s.
class Connection : public httplib::Stream {
 public:
  Connection(int socket, const std::atomic<bool>& ends) : socket_(socket), ends_(ends), until_(in(kRequest_s)) {}

  bool is_readable() const override { return begin_ < end_ || ready(POLLIN, 0); }
  /// False as well once the other side has gone.
  bool is_writable() const override {
    char byte;
    const auto seen = recv(socket_, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    return seen > 0 || (seen < 0 && (errno == EAGAIN || errno == EWOULDBLOCK));
  }
  ssize_t read(char* to, std::size_t size) override {
    if (begin_ == end_ && !fill()) return -1;
    const std::size_t count = std::min(size, end_ - begin_);
    std::copy_n(buffer_ + begin_, count, to);
    begin_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, std::size_t size) override {
    const auto until = in(kWrite_s);
    for (std::size_t sent = 0; sent < size;) {
      const auto now = send(socket_, from + sent, size - sent, MSG_DONTWAIT | MSG_NOSIGNAL);
      if (now > 0) sent += static_cast<std::size_t>(now);
      const bool full = now < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
      if (now <= 0 && (!full || !wait(POLLOUT, until))) return -1;
    }
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string& ip, int& port) const override { name(&getpeername, ip, port); }
  void get_local_ip_and_port(std::string& ip, int& port) const override { name(&getsockname, ip, port); }
  socket_t socket() const override { return socket_; }

  /// Closes it so that the answer arrives: what was sent and not read would take it back.
  void close() {
    shutdown(socket_, SHUT_WR);
    const auto until = in(0.2);
    std::size_t left = std::size_t{64} << 10;
    while (left > 0 && wait(POLLIN, until)) {
      const auto count = recv(socket_, buffer_, sizeof buffer_, MSG_DONTWAIT);
      if (count <= 0) break;
      left -= std::min(left, static_cast<std::size_t>(count));
    }
    ::close(socket_);
  }

 private:
  bool ready(short what, int milliseconds) const {
    pollfd one{socket_, what, 0};
    return poll(&one, 1, milliseconds) > 0;
  }
  bool wait(short what, Clock::time_point until) const {
    while (!ends_ && Clock::now() < until)
      if (ready(what, kSlice_ms)) return true;
    return false;
  }
  bool fill() {
    if (budget_ == 0 || !wait(POLLIN, until_)) return false;
    const auto count = recv(socket_, buffer_, std::min(budget_, sizeof buffer_), MSG_DONTWAIT);
    if (count <= 0) return false;
    begin_ = 0;
    end_ = static_cast<std::size_t>(count);
    budget_ -= end_;
    return true;
  }
  void name(int (*of)(int, sockaddr*, socklen_t*), std::string& ip, int& port) const {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    char text[INET_ADDRSTRLEN] = "";
    if (of(socket_, reinterpret_cast<sockaddr*>(&address), &size) != 0) return;
    inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
    ip = text;
    port = ntohs(address.sin_port);
  }

  int socket_;
  const std::atomic<bool>& ends_;
  Clock::time_point until_;
  std::size_t budget_ = kRequestBytes, begin_ = 0, end_ = 0;
  char buffer_[4096];
};

/// The requests of strangers that are being answered, by age. Each is taken out before its socket is closed.
class Strangers {
 public:
  std::uint64_t add(int socket) {
    const std::lock_guard lock(mutex_);
    sockets_[++last_] = socket;
    return last_;
  }
  void remove(std::uint64_t number) {
    const std::lock_guard lock(mutex_);
    sockets_.erase(number);
  }
  /// Ends the oldest; false: there is none. Its thread sees that at once, or in a stream within 0.1 s.
  bool end_oldest() {
    const std::lock_guard lock(mutex_);
    if (sockets_.empty()) return false;
    shutdown(sockets_.begin()->second, SHUT_RDWR);
    sockets_.erase(sockets_.begin());
    return true;
  }

 private:
  std::mutex mutex_;
  std::map<std::uint64_t, int> sockets_;
  std::uint64_t last_ = 0;
};

/// A thread for each request that has a place, or leaves one. None waits for another: those who show a key have places
/// of their own.
class Server : public httplib::Server {
 public:
  /// Answers until `stopped`.
  void run(const std::function<bool(std::string_view)>& is_key, const std::function<bool()>& stopped) {
    Porch porch(svr_sock_);
    httplib::ThreadPool threads(kKnown + kStrangers + kLeaving);
    while (!stopped())
      porch.step(kSlice_ms, [&](int socket, std::string_view seen) {
        const bool known = shows_key(seen, is_key);
        if (!has_place(known)) return turn_away(socket);
        ++(known ? known_ : strange_);
        // Counted among the strangers here, in the order in which they came.
        const auto number = known ? std::nullopt : std::optional(strangers_.add(socket));
        threads.enqueue([this, socket, number] { serve(socket, number); });
      });
    ends_ = true;
    ::close(svr_sock_.exchange(INVALID_SOCKET));
    threads.shutdown();
  }

 private:
  bool has_place(bool known) {
    if (known) return known_ < kKnown;
    return strange_ < kStrangers || (strange_ < kStrangers + kLeaving && strangers_.end_oldest());
  }
  static void turn_away(int socket) {
    constexpr std::string_view kFull =
        "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";
    recv(socket, nullptr, kRequestBytes, MSG_TRUNC | MSG_DONTWAIT);  // what is unread would take the answer back
    send(socket, kFull.data(), kFull.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    ::close(socket);
  }
  void serve(int socket, std::optional<std::uint64_t> stranger) {
    const int on = 1;
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    Connection connection(socket, ends_);
    bool closed = false;
    process_request(connection, true, closed, nullptr);
    if (stranger) strangers_.remove(*stranger);
    connection.close();
    --(stranger ? strange_ : known_);
  }

  Strangers strangers_;
  std::atomic<std::size_t> known_{0}, strange_{0};
  std::atomic<bool> ends_{false};
};

Head head_of(const httplib::Request& request) {
  const auto header = [&](const char* name) { return request.get_header_value(name); };
  return {request.method,
          header("Host"),
          header("Origin"),
          header("Sec-Fetch-Site"),
          header("Content-Type"),
          header("Content-Encoding"),
          header("X-Token"),
          request.get_header_value_count("Host"),
          request.has_header("Range")};
}

Asked asked_of(const httplib::Request& request) {
  return {{request.params.begin(), request.params.end()}, request.body, request.remote_addr};
}

void answer(const Reply& reply, httplib::Response& response) {
  response.status = reply.status;
  response.set_content(reply.body, reply.type);
}

/// What every answer tells a browser: nothing but our own files, in no other site's frame, kept nowhere, told to
/// nobody.
const httplib::Headers kHeaders = {
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; base-uri 'none'; "
     "form-action 'none'; frame-ancestors 'none'"},
    {"Referrer-Policy", "no-referrer"},
    {"X-Content-Type-Options", "nosniff"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cache-Control", "no-store"},
};

void open_stream(const std::variant<Reply, NextEvents>& opened, httplib::Response& response) {
  if (const auto* reply = std::get_if<Reply>(&opened)) return answer(*reply, response);
  response.set_chunked_content_provider(
      "text/event-stream", [next = std::get<NextEvents>(opened)](std::size_t, httplib::DataSink& sink) {
        const std::string text = next();
        return sink.is_writable() && (text.empty() || sink.write(text.data(), text.size()));
      });
}

void add_site(httplib::Server& server, const Site& site) {
  for (const auto& [path, file] : site.files)
    server.Get(path, [&file = file](const auto&, auto& response) { answer(file, response); });
  for (const auto& [path, read] : site.reads)
    server.Get(path,
               [&read = read](const auto& request, auto& response) { answer(read(asked_of(request)), response); });
  for (const auto& [path, post] : site.posts)
    server.Post(path, [&post = post](const httplib::Request& request, httplib::Response& response) {
      answer(post(asked_of(request)), response);
    });
  for (const auto& [path, stream] : site.streams)
    server.Get(path, [&stream = stream](const auto& request, auto& response) {
      open_stream(stream(asked_of(request)), response);
    });
}

}  // namespace

void serve_http(const Door& door, const Site& site, const std::function<void(int port)>& listening,
                const std::function<bool()>& stopped) {
  Server server;
  server.set_default_headers(kHeaders);
  server.set_payload_max_length(kBodyBytes);
  server.set_address_family(AF_INET);
  server.set_socket_options([](socket_t socket) {  // not SO_REUSEPORT: a port that is in use is nobody else's
    const int on = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  });
  add_site(server, site);
  int port = door.port;
  server.set_pre_routing_handler([&](const httplib::Request& request, httplib::Response& response) {
    const auto reply = refused(head_of(request), port, door.token);
    if (reply) answer(*reply, response);
    return reply ? httplib::Server::HandlerResponse::Handled : httplib::Server::HandlerResponse::Unhandled;
  });
  server.set_exception_handler(
      [](const auto&, auto& response, const auto&) { answer(refusal(500, "a defect of backwashctl"), response); });
  if (port == 0)
    port = server.bind_to_any_port(door.address);
  else if (!server.bind_to_port(door.address, port))
    port = -1;
  if (port < 0)
    throw StartError(kSystem, "serve: " + door.address + ":" + std::to_string(door.port) +
                                  " cannot be listened on: give an --address of this machine and a free --port");
  listening(port);
  server.run([&](std::string_view key) { return is_token(key, door.token) || site.knows(std::string(key)); }, stopped);
}

}  // namespace backwash::ctl
