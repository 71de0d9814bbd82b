// SPDX-License-Identifier: MIT
// serverInt32: a server that echoes Int32 messages, written for the original MPF.
//
// The manual names this file ("Message Server", "Example") and prints no source of it. The function
// follows the five steps of "Message Server", with the loop of "EXAMPLE Implementation: ip330Scan".
// The lines below "for Linux" complete it: on vxWorks, the startup file calls initServerInt32().
#include <vxWorks.h>
#include <stdio.h>
#include <taskLib.h>

#include "Message.h"
#include "Int32Message.h"
#include "mpfType.h"

class ServerInt32 {
public:
    MessageServer *pMessageServer;
    static void serverInt32(ServerInt32 *);
};

static char taskname[] = "serverInt32";
extern "C" int initServerInt32(const char *name,int queueSize)
{
    ServerInt32 *pServerInt32 = new ServerInt32;
    pServerInt32->pMessageServer = new MessageServer(name);
    pServerInt32->pMessageServer->setQueueSize(queueSize);
    int taskId = taskSpawn(taskname,100,VX_FP_TASK,2000,
        (FUNCPTR)ServerInt32::serverInt32,(int)pServerInt32,
        0,0,0,0,0,0,0,0,0);
    if(taskId==ERROR)
        printf("%s serverInt32 taskSpawn Failure\n",
            pServerInt32->pMessageServer->getName());
    return(0);
}

void ServerInt32::serverInt32(ServerInt32 *pServerInt32)
{
    while(true) {
        MessageServer *pMessageServer = pServerInt32->pMessageServer;
        pMessageServer->waitForMessage();
        Message *inmsg;
        while((inmsg = pMessageServer->receive())) {
            if(inmsg->getType()!=messageTypeInt32) {
                printf("%s serverInt32 got illegal message type %d\n",
                    pMessageServer->getName(), inmsg->getType());
                delete inmsg;
                continue;
            }
            Int32Message *pmessage = (Int32Message *)inmsg;
            if(pmessage->cmd==1) {    // an additional message, as the manual's step 5
                Int32Message *padditional = (Int32Message *)
                    pMessageServer->allocReplyMessage(pmessage,messageTypeInt32);
                padditional->value = -pmessage->value;
                pMessageServer->reply(padditional);
            }
            pmessage->status = 0;
            pMessageServer->reply(pmessage);
        }
    }
}

// ---- for Linux
#include <unistd.h>

int main(int argc, char **argv)
{
    initServerInt32(argc > 1 ? argv[1] : "Int32", 20);
    while(true) pause();    // the task serves; a signal ends the process
}
