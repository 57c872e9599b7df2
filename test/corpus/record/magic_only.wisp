wisp picture 1
