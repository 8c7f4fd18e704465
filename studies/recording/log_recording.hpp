#pragma once

#include <memory>
#include <string>
#include <vector>

#include <tandem/studies/recording/message_decoder.hpp>
#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// A log of self-described messages without receive times: the common part of ArduPilot and PX4 logs. A derived class
/// adds streams, and calls receive() for each message in scan().
class LogRecording : public Recording {
 public:
  void read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) final;

 protected:
  /// Adds a stream whose messages have this type. `time_field` must give seconds.
  std::size_t add_stream(const std::string& name, const std::string& type, std::shared_ptr<const MessageType> message,
                         const std::string& time_field);
  void receive(std::size_t stream, std::string_view bytes);
  /// Counts the rows of all streams. To be called at the end of the constructor.
  void count_rows();
  bool lists() const { return counting_; }

  /// Goes through the file.
  virtual void scan(const std::function<void()>& stop) = 0;

 private:
  void receive_whole(std::size_t stream, std::string_view bytes);
  void report_short_messages();

  struct Consumer {
    MessageDecoder decoder;
    const RowRequest* request;
  };
  bool counting_ = false;
  std::vector<std::shared_ptr<const MessageType>> types_;
  std::vector<std::unique_ptr<MessageDecoder>> times_;
  std::vector<std::vector<Consumer>> consumers_;
  std::vector<std::size_t> short_messages_;
};

}  // namespace tandem
