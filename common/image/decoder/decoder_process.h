// The process that decodes images for a program: `lightmill-image-decoder`, which reads each in a sandboxed child.
//
// Image files come from strangers, and the libraries that read them have faults; some even open files and addresses
// that an image names. The child that reads an image has its bytes, room for its pixels, and nothing else of the
// machine (decoder/confined_child.h).
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/decoder/decoder_protocol.h"
#include "common/image/image_size.h"
#include "common/image/texels.h"

namespace lightmill {

/// The decoder's program beside this one.
std::filesystem::path image_decoder_program();

struct DecoderOptions {
  std::filesystem::path program = image_decoder_program();
  bool unsandboxed = false;                                        ///< decode also where the kernel refuses the sandbox
  std::chrono::milliseconds time_limit = std::chrono::minutes(2);  ///< for one image
};

/// Starts the process with the first image, and again after it was killed; ends it with itself. One thread may use it.
///
/// Errors begin with the image's name. INVALID_ARGUMENT: the image is at fault. RESOURCE_EXHAUSTED: it takes more than
/// this machine has or allows. FAILED_PRECONDITION: this machine cannot decode images.
class DecoderProcess {
 public:
  explicit DecoderProcess(DecoderOptions options) : options_(std::move(options)) {}
  DecoderProcess(const DecoderProcess&) = delete;
  DecoderProcess& operator=(const DecoderProcess&) = delete;
  ~DecoderProcess() { stop(); }

  /// As the file's header says.
  Result<ImageSize> size(ByteView bytes, const std::string& name);
  /// What read_image_within (image/read/read_image.h) gives. The pixels stay in the memory that the decoder filled.
  Result<Texels> decode(ByteView bytes, const std::string& name, std::int64_t max_pixels = kMaxTexturePixels);

  /// Of the running process; 0 if there is none.
  pid_t pid() const { return pid_; }

 private:
  Status start();
  /// How the process ended, in words; it is killed if it has not.
  std::string stop();
  Result<DecodeReply> ask(ByteView bytes, std::int64_t max_pixels, int room);
  Result<DecodeReply> exchange(const DecodeRequest& request, int file, int room);
  Result<Texels> take_pixels(const DecodeReply& reply, std::int64_t max_pixels, int room);

  const DecoderOptions options_;
  pid_t pid_ = 0;
  int socket_ = -1;
};

}  // namespace lightmill
