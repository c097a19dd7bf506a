/* Message IDs from topics, as in the first processor of the sample mission of the cFE; see cfe.h. */
#ifndef CFE_CORE_API_BASE_MSGIDS_H
#define CFE_CORE_API_BASE_MSGIDS_H

#define CFE_PLATFORM_CMD_TOPICID_TO_MIDV(topic) (0x1800 | (topic))
#define CFE_PLATFORM_TLM_TOPICID_TO_MIDV(topic) (0x0800 | (topic))

#endif
