#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/studies/recording/byte_reader.hpp>
#include <tandem/studies/recording/message_type.hpp>
#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// Arrangement of the bytes of a message.
enum class MessageEncoding {
  cdr,     ///< ROS 2: a header of 4 bytes with the byte order, then aligned members
  ros1,    ///< members without padding
  packed,  ///< members without padding, in logs
};

/// Returns the leaves of a type as fields, for example "pose.pose.position.x". Lists the first elements of sequences; a
/// field with any other index can be requested.
std::vector<RecordedField> fields_of(const MessageType& type);

/// Decodes the requested fields of messages of one type and skips all others.
class MessageDecoder {
 public:
  /// Throws Error if the type has no such field.
  MessageDecoder(std::shared_ptr<const MessageType> type, MessageEncoding encoding,
                 const std::vector<std::string>& fields);

  /// Returns the values in the order of the fields; missing elements of sequences are nan. The texts refer to `bytes`.
  /// Throws OutOfBytes if the bytes end early.
  const std::vector<RecordedValue>& decode(std::string_view bytes);

 private:
  struct Node;
  /// A wanted element of a member: a value, or parts of a nested message.
  struct Branch {
    std::size_t element = 0;
    int slot = -1;  ///< index of the value; -1 for a nested message
    std::unique_ptr<Node> nested{};
  };
  /// The wanted parts of a message, by member.
  struct Node {
    std::vector<std::vector<Branch>> members;
  };

  void want(const MessageType& type, std::string_view path, int slot, Node& node, const std::string& field);
  void read_message(ByteReader& in, const MessageType& type, const Node* node, std::size_t end);
  void read_member(ByteReader& in, const MessageMember& member, const std::vector<Branch>* wanted);
  void skip_elements(ByteReader& in, const MessageMember& member, std::size_t count);
  RecordedValue read_value(ByteReader& in, const MessageMember& member);
  void align(ByteReader& in, Primitive type) const;

  std::shared_ptr<const MessageType> type_;
  MessageEncoding encoding_;
  Node wanted_;
  std::size_t end_ = 0;  ///< number of members up to the last wanted one
  std::vector<RecordedValue> values_;
  std::size_t max_align_ = 8;
};

}  // namespace tandem
