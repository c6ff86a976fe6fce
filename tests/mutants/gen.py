# scratch: compact form -> toml
import sys,re
out={}
cur=None
for line in open(sys.argv[1]):
    line=line.rstrip("\n")
    if not line.strip() : continue
    if line.startswith("## "): fn=line[3:].split(" ",1); name=fn[0]; out.setdefault(name,[]); out[name].append("# SPDX-License-Identifier: BSD-3-Clause\n# "+fn[1]+"\n"); continue
    if line.startswith("@ "):
        f,t=line[2:].split(" | ")
        tests=[x.strip() for x in t.split(";")]
        out[name].append("[[source]]\nfile = \"%s\"\ntests = [%s]\n"%(f,", ".join('"%s"'%x for x in tests)))
        continue
    if line.startswith("- "): cur={"id":line[2:].strip()}; 
    m=re.match(r"  (\w+): (.*)$",line)
    if m: 
        cur[m.group(1)]=m.group(2)
        if m.group(1)=="b":
            s='[[source.mutant]]\nid = "%s"\n'%cur["id"]
            def lit(x): 
                x=x.replace("\\n","\n")
                if "\n" in x: return "'''"+x+"'''"
                return "'%s'"%x if "'" not in x else "'''"+x+"'''"
            s+="find = %s\n"%lit(cur["f"])
            if "at" in cur: s+='at = "%s"\n'%cur["at"]
            s+="with = %s\n"%lit(cur.get("w",""))
            s+='breaks = "%s"\n'%cur["b"]
            if "t" in cur: s+="tests = [%s]\n"%", ".join('"%s"'%x.strip() for x in cur["t"].split(";"))
            if "e" in cur: s+='equivalent = "%s"\n'%cur["e"]
            out[name].append(s)
for n,parts in out.items(): open(n,"w").write("\n".join(parts))
