#include "common/security/connection_problem.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "common/base/address.h"
#include "common/security/caller.h"
#include "common/security/openssl_handles.h"

namespace lightmill {
namespace {

constexpr int kConnectTimeoutMs = 2'000;
constexpr timeval kTimeout{2, 0};
constexpr std::chrono::milliseconds kPauseOfAttempts{500};

/// Waits for a socket to connect. Then sets its time limits. 0, or the errno.
int wait_until_connected(int socket) {
  pollfd ready{socket, POLLOUT, 0};
  int error = 0;
  socklen_t size = sizeof error;
  if (::poll(&ready, 1, kConnectTimeoutMs) != 1 || ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) != 0) {
    return ETIMEDOUT;
  }
  (void)::fcntl(socket, F_SETFL, ::fcntl(socket, F_GETFL) & ~O_NONBLOCK);
  (void)::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &kTimeout, sizeof kTimeout);
  (void)::setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &kTimeout, sizeof kTimeout);
  return error;
}

/// A connected socket; -1 if nothing listens.
class Socket {
 public:
  explicit Socket(const HostPort& to) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (::getaddrinfo(to.host.c_str(), std::to_string(to.port).c_str(), &hints, &found) != 0) {
      return;
    }
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
    for (const addrinfo* each = found; each != nullptr && fd_ < 0; each = each->ai_next) {
      connect(*each);
    }
  }
  ~Socket() { close(); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

 private:
  void connect(const addrinfo& address) {
    fd_ = ::socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd_ < 0) {
      return;
    }
    const int error = ::connect(fd_, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
    if ((error != 0 && error != EINPROGRESS) || wait_until_connected(fd_) != 0) {
      close();
    }
  }
  void close() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
    fd_ = -1;
  }
  int fd_ = -1;
};

/// A context with the authorities and the certificate of `texts`, as far as they can be read. Null without memory.
openssl::Context context_of(const TlsTexts& texts) {
  openssl::Context context(SSL_CTX_new(TLS_client_method()));
  if (context == nullptr) {
    return context;
  }
  if (const auto authorities = openssl::certificates_in(texts.authority); authorities.ok()) {
    for (const openssl::Certificate& each : *authorities) {
      X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), each.get());
    }
  }
  X509_STORE_set_flags(SSL_CTX_get_cert_store(context.get()), X509_V_FLAG_PARTIAL_CHAIN);  // as gRPC does
  const auto own = openssl::certificates_in(texts.certificate);
  const auto key = openssl::key_in(texts.key);
  if (own.ok() && key.ok()) {
    SSL_CTX_use_certificate(context.get(), own->front().get());
    for (std::size_t i = 1; i < own->size(); ++i) {
      SSL_CTX_add1_chain_cert(context.get(), (*own)[i].get());
    }
    SSL_CTX_use_PrivateKey(context.get(), key->get());
  }
  constexpr std::array<unsigned char, 3> kHttp2{2, 'h', '2'};
  SSL_CTX_set_alpn_protos(context.get(), kHttp2.data(), kHttp2.size());
  return context;
}

/// The facts of the certificate that the other end showed.
std::optional<CertificateFacts> shown_by(SSL* connection) {
  const openssl::Certificate certificate(SSL_get1_peer_certificate(connection));
  if (certificate == nullptr) {
    return std::nullopt;
  }
  const openssl::Bio text(BIO_new(BIO_s_mem()));
  if (text == nullptr || PEM_write_bio_X509(text.get(), certificate.get()) != 1) {
    return std::nullopt;
  }
  char* bytes = nullptr;
  const long size = BIO_get_mem_data(text.get(), &bytes);
  auto all = read_certificates(std::string_view(bytes, static_cast<std::size_t>(size)));
  return all.ok() ? std::optional(std::move(all->front())) : std::nullopt;
}

std::string verdict(long code, const HostPort& to, const CertificateFacts& facts) {
  switch (code) {
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return fmt::format(
          "its certificate is for {}, not for {}: use one of those names, or make a certificate that names this one",
          fmt::join(facts.hosts, ", "), to.host);
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return fmt::format("its certificate expired {}: renew it there", date_text(facts.until_unix_s));
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return fmt::format("its certificate is valid from {}: check this machine's clock", date_text(facts.from_unix_s));
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
    case X509_V_ERR_CERT_SIGNATURE_FAILURE:
      return fmt::format("its certificate is signed by '{}', which is not the authority of {}: give that farm's",
                         facts.issuer, kAuthorityOption);
    default:
      return fmt::format("its certificate is not accepted: {}", X509_verify_cert_error_string(code));
  }
}

/// The reason if a coordinator closes the connection once it has seen our certificate. It does not say why.
std::optional<std::string> refusal(const TlsTexts& texts) {
  const auto facts = read_certificates(texts.certificate);
  if (!facts.ok()) {
    return std::nullopt;
  }
  return fmt::format(
      "it refuses the certificate of {}, signed by '{}': check that this is the farm's authority, and that the "
      "certificate is for callers",
      kCertificateOption, facts->front().issuer);
}

void expect_host(SSL* connection, const std::string& host) {
  std::array<unsigned char, 16> address{};
  if (::inet_pton(AF_INET, host.c_str(), address.data()) == 1 ||
      ::inet_pton(AF_INET6, host.c_str(), address.data()) == 1) {
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(connection), host.c_str());
  } else {
    SSL_set_tlsext_host_name(connection, host.c_str());
    SSL_set1_host(connection, host.c_str());
  }
}

// ---- a call over HTTP/2 (RFC 9113), with a header block without compression (RFC 7541) ----

constexpr char kData = 0, kHeaders = 1, kSettings = 4;  ///< types of frames
constexpr char kEndOfStream = 1, kEndOfHeaders = 4;     ///< flags
constexpr std::size_t kFrameHeadBytes = 9;
/// Frames of the other side before its answer: settings, pings and windows. A server of ours sends a few.
constexpr int kMaxFrames = 64;

std::string frame(char type, char flags, char stream, std::string_view payload) {
  std::string bytes{0, 0, static_cast<char>(payload.size()), type, flags, 0, 0, 0, stream};
  return bytes += payload;
}

std::string sized(std::string_view text) {
  return static_cast<char>(text.size()) + std::string(text);
}

/// A new connection with a call of grpc.health.v1.Health/Check for the service "".
std::string health_call() {
  const std::string headers =
      "\x83\x86"  // :method POST, :scheme http
      "\x04" +
      sized("/grpc.health.v1.Health/Check") +   // :path
      "\x01" + sized("localhost") +             // :authority
      "\x0f\x10" + sized("application/grpc") +  // content-type
      std::string(1, '\0') + sized("te") + sized("trailers");
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(kSettings, 0, 0, "") + frame(kHeaders, kEndOfHeaders, 1, headers) +
         frame(kData, kEndOfStream, 1, std::string(5, '\0'));  // an empty message
}

/// Sends the call and waits for the head of its answer. `send` and `receive` move all bytes, or return false.
template <class Send, class Receive>
bool calls(const Send& send, const Receive& receive) {
  std::string head(kFrameHeadBytes, '\0'), payload;
  if (!send(health_call())) {
    return false;
  }
  for (int i = 0; i < kMaxFrames && receive(head); ++i) {
    const auto byte = [&](std::size_t at) { return std::size_t{static_cast<unsigned char>(head[at])}; };
    if (head[3] == kHeaders && byte(8) == 1) {
      return true;
    }
    payload.resize(byte(0) << 16 | byte(1) << 8 | byte(2));
    if (!receive(payload)) {
      return false;
    }
  }
  return false;
}

struct Problem {
  std::optional<std::string> text;
  bool refused =
      false;  ///< the coordinator sent an alert or closed the connection: it refuses our certificate, or ends
};

Problem problem_of_attempt(const std::string& address, const TlsTexts& texts) {
  const Result<HostPort> to = parse_host_port(address);
  const openssl::Context context = context_of(texts);
  if (!to.ok() || context == nullptr) {
    return {};
  }
  const Socket socket(*to);
  if (socket.fd() < 0) {
    return {};
  }
  const openssl::Connection connection(SSL_new(context.get()));
  if (connection == nullptr || SSL_set_fd(connection.get(), socket.fd()) != 1) {
    return {};
  }
  expect_host(connection.get(), to->host);
  ERR_clear_error();
  const bool speaks_tls = SSL_connect(connection.get()) == 1;
  if (!texts.given()) {
    return {speaks_tls ? std::optional(fmt::format("it accepts only encrypted connections: give {} (and {})",
                                                   kAuthorityOption, kCertificateOption))
                       : std::nullopt};
  }
  if (!speaks_tls) {
    if (ERR_GET_REASON(ERR_peek_last_error()) == SSL_R_WRONG_VERSION_NUMBER) {
      return {fmt::format("it does not accept encrypted connections: leave out {} (and {}), or give the coordinator {}",
                          kAuthorityOption, kAuthorityVariable, kCertificateOption)};
    }
    // Without an alert, the coordinator may be slow, overloaded or ending.
    return {std::nullopt, ERR_GET_REASON(ERR_peek_last_error()) > SSL_AD_REASON_OFFSET};
  }
  const std::optional<CertificateFacts> facts = shown_by(connection.get());
  if (const long code = SSL_get_verify_result(connection.get()); code != X509_V_OK && facts) {
    return {verdict(code, *to, *facts)};
  }
  // With TLS 1.3 the other side checks our certificate after the handshake. If it accepts it, HTTP/2 sends something
  // first.
  char first = 0;
  const int got = SSL_read(connection.get(), &first, 1);
  const bool silent = got <= 0 && SSL_get_error(connection.get(), got) == SSL_ERROR_WANT_READ;  // within our time limit
  return {std::nullopt, got <= 0 && !silent};
}

}  // namespace

Status check_answers(int socket, bool encrypted) {
  if (const int error = wait_until_connected(socket); error != 0) {
    return unavailable("no connection: {}", std::strerror(error));
  }
  if (!encrypted) {
    const bool answers = calls(
        [socket](std::string_view bytes) {
          return ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
        },
        [socket](std::string& bytes) {
          return ::recv(socket, bytes.data(), bytes.size(), MSG_WAITALL) == static_cast<ssize_t>(bytes.size());
        });
    return answers ? ok_status() : unavailable("no answer to a health check");
  }
  const openssl::Context context = context_of({});
  const openssl::Connection connection(context == nullptr ? nullptr : SSL_new(context.get()));
  if (connection == nullptr || SSL_set_fd(connection.get(), socket) != 1) {
    return internal_error("no TLS connection can be made");
  }
  ERR_clear_error();
  const bool answers =
      SSL_connect(connection.get()) == 1 &&
      calls(
          [&](std::string_view bytes) {
            return SSL_write(connection.get(), bytes.data(), static_cast<int>(bytes.size())) > 0;
          },
          [&](std::string& bytes) {
            int got = 1;
            std::size_t done = 0;
            for (; got > 0 && done < bytes.size(); done += static_cast<std::size_t>(std::max(got, 0))) {
              got = SSL_read(connection.get(), bytes.data() + done, static_cast<int>(bytes.size() - done));
            }
            return got > 0;
          });
  return answers ? ok_status() : unavailable("no answer to a health check over TLS");
}

std::optional<std::string> connection_problem(const std::string& address, const TlsTexts& texts) {
  Problem problem = problem_of_attempt(address, texts);
  if (problem.refused) {
    // A coordinator that is shutting down closes its connections in the same way. A second attempt tells the two apart.
    std::this_thread::sleep_for(kPauseOfAttempts);
    problem = problem_of_attempt(address, texts);
  }
  return problem.refused ? refusal(texts) : problem.text;
}

std::string_view cause_of_silence(std::string_view grpc_message) {
  const auto has = [grpc_message](std::string_view part) { return grpc_message.find(part) != grpc_message.npos; };
  return has("Connection refused")      ? "nothing listens there. Start lightmill-server, or give another --server"
         : has("DNS resolution failed") ? "unknown host name"
         : has("http1.x server") || has("ALPN")
             ? "a web server answers there. Give the port of lightmill-server's --listen, not of --http"
         : has("No route to host") || has("Network is unreachable")
             ? "no route to the host"
             : "no coordinator answers there. Check the address and the firewall";
}

}  // namespace lightmill
