#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/decompress.hpp>
#include <tandem/studies/recording/message_recording.hpp>

namespace tandem {

void MessageRecording::add_topic(const std::string& topic, const std::string& type, const std::string& encoding,
                                 const std::string& definition) {
  RecordedStream stream{topic, short_type_name(type)};
  if (find(topic)) stream.name = topic + " (" + stream.type + ")";  // one topic with two types
  const bool ros1 = encoding == "ros1";
  std::shared_ptr<const MessageType> parsed;
  try {
    if (!ros1 && encoding != "cdr")
      throw Error(fmt::format("its messages have the encoding {}; readable are cdr and ros1", encoding));
    // Definitions in IDL are not parsed; for those, and for none, the built-in ones apply.
    const bool idl = definition.find("module ") != std::string::npos && definition.find('{') != std::string::npos;
    std::string text = definition.empty() || idl ? builtin_definition(stream.type) : definition;
    if (text.empty())
      throw Error(
          fmt::format("the bag has no definition of {}, and it is not built in; convert the bag to MCAP, which "
                      "embeds definitions",
                      type));
    parsed = parse_message_definition(type, text, ros1);
    stream.fields = fields_of(*parsed);
    for (const RecordedField& field : stream.fields)
      if (field.name == "header.stamp" || (stream.time_field.empty() && field.name == "stamp"))
        stream.time_field = field.name;
  } catch (const Error& error) {
    stream.unreadable = error.what();
  }
  streams_.push_back(std::move(stream));
  types_.push_back(std::move(parsed));
  encodings_.push_back(ros1 ? MessageEncoding::ros1 : MessageEncoding::cdr);
  consumers_.emplace_back();
  short_messages_.push_back(0);
}

std::size_t MessageRecording::topic_index(const std::string& topic, const std::string& type) const {
  const std::string wanted = short_type_name(type);
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if ((streams_[i].name == topic || streams_[i].name == topic + " (" + wanted + ")") && streams_[i].type == wanted)
      return i;
  return streams_.size();
}

void MessageRecording::count(std::size_t topic, double received) {
  RecordedStream& stream = streams_[topic];
  ++stream.rows;
  if (!(stream.first <= received)) stream.first = received;
  if (!(stream.last >= received)) stream.last = received;
}

void MessageRecording::reset_counts() {
  for (RecordedStream& stream : streams_) {
    stream.rows = 0;
    stream.first = stream.last = std::nan("");
  }
}

void MessageRecording::receive(std::size_t topic, double received, std::string_view bytes) {
  if (encodings_[topic] == MessageEncoding::cdr && is_zstd(bytes)) {  // no header of CDR begins like this
    if (const std::string why = decompress_message(bytes, decompressed_); !why.empty()) {
      add_defect(fmt::format("{}: a message is dropped: {}", streams_[topic].name, why));
      return;
    }
    bytes = decompressed_;
  }
  for (Consumer& consumer : consumers_[topic]) try {
      consumer.request->row({received, consumer.decoder.decode(bytes)});
    } catch (const OutOfBytes&) {
      ++short_messages_[topic];
    }
}

void MessageRecording::read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) {
  for (auto& consumers : consumers_) consumers.clear();
  for (const RowRequest& request : requests)
    for (std::size_t i = 0; i < streams_.size(); ++i)
      if (streams_[i].name == request.stream && types_[i])
        consumers_[i].push_back({MessageDecoder(types_[i], encodings_[i], request.fields), &request});
  read_messages(stop);
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (short_messages_[i] > 0)
      add_defect(fmt::format("{}: {} messages end before their definition does; they are dropped", streams_[i].name,
                             std::exchange(short_messages_[i], 0)));
}

}  // namespace tandem
