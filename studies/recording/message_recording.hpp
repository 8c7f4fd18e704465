#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/studies/recording/message_decoder.hpp>
#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// A recording of serialised messages on topics: the common part of all bags. A derived class lists the topics with
/// add_topic() and calls receive() for each message.
class MessageRecording : public Recording {
 public:
  void read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) final;

 protected:
  /// Adds a stream. `encoding` is "cdr" or "ros1"; `definition` may be empty for built-in messages.
  void add_topic(const std::string& topic, const std::string& type, const std::string& encoding,
                 const std::string& definition);
  std::size_t topics() const { return streams_.size(); }
  /// Returns the index of a topic of this type, or topics().
  std::size_t topic_index(const std::string& topic, const std::string& type) const;
  /// Counts a message of a topic: its number of rows and its span.
  void count(std::size_t topic, double received);
  /// Sets the numbers of rows to 0.
  void reset_counts();
  /// Passes on a message of a wanted topic, which may be compressed (rosbag2's compression mode MESSAGE).
  void receive(std::size_t topic, double received, std::string_view bytes);
  bool is_wanted(std::size_t topic) const { return !consumers_[topic].empty(); }

  /// Calls receive() for all messages of wanted topics.
  virtual void read_messages(const std::function<void()>& stop) = 0;

 private:
  struct Consumer {
    MessageDecoder decoder;
    const RowRequest* request;
  };
  std::vector<std::shared_ptr<const MessageType>> types_;  ///< null if unreadable
  std::vector<MessageEncoding> encodings_;
  std::vector<std::vector<Consumer>> consumers_;
  std::vector<std::size_t> short_messages_;
  std::string decompressed_;
};

}  // namespace tandem
